"""The demonstration of the package: `python -m supple demo`."""

import xml.etree.ElementTree

from supple.__main__ import main


def test_the_demonstration_tells_a_table_and_draws_a_picture(tmp_path, capsys):
    picture = tmp_path / "demo.svg"
    assert main(["demo", "--out", str(picture)]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    exact, long = ([float(word) for word in row[1:7]] for row in rows if row[0] in ("exact", "long"))
    assert exact[0] > 10 * long[0]
    assert 6.0 < exact[4] < 12.0 and exact[5] == 0.0
    assert abs(long[4] - exact[4]) < 0.5 and 0.0 < long[5] < 0.5
    shapes = [shape.tag.rpartition("}")[2] for shape in xml.etree.ElementTree.parse(picture).getroot()]
    assert shapes.count("circle") == 2 and shapes.count("polygon") > 1000


def test_a_picture_that_cannot_be_written_is_an_error(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "nowhere" / "demo.svg")]) == 2
    assert "demo.svg: cannot be written: No such file" in capsys.readouterr().err
