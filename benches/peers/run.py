"""The engines that a user can install today, and supple, on two scenes: error and computing time.

    python3 benches/peers/run.py [--scene a|b] [--quick] [--only supple,mujoco,rapier,newton,ngsolve] [--program target/release/supple]

Installs pinned versions from PyPI into target/peers/venv, builds rapier3d from crates.io in target/peers/rapier, and supple. Writes results.csv here, and the
tables of docs/benchmarks.md between their two comments. One engine runs after the other, each on one thread; times are processor time.
--quick runs the first setting of each engine and writes nothing but target/peers. --check compares supple's first rows of scene B with results.csv.
"""

import argparse
import csv
import datetime
import json
import os
import platform
import re
import subprocess
import sys
import venv
from pathlib import Path

from scenes import HERE, SCENES, errors, truth

ROOT = HERE.parents[1]
TARGET = ROOT / "target/peers"
RESULTS = HERE / "results.csv"
DOCS = ROOT / "docs/benchmarks.md"
HEADS = "scene,engine,version,setting,mesh,error_at_rest_percent,error_of_swing_percent,processor_s_per_s,over_supple,supple_no_less_accurate,note,date,machine"
ENGINES = ["supple", "mujoco", "rapier", "newton", "ngsolve"]
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")}


def call(*words, **more):
    return subprocess.run(list(map(str, words)), check=True, **more)


def python():
    """That of the virtual environment with the other engines."""
    found, wanted = TARGET / "venv/bin/python", HERE / "requirements.txt"
    mark = TARGET / "venv/installed"
    if not mark.exists() or mark.read_text() != wanted.read_text():
        venv.create(TARGET / "venv", with_pip=True)
        call(found, "-m", "pip", "install", "--quiet", "--requirement", wanted)
        mark.write_text(wanted.read_text())
    return found


def command(name, program, scene, out):
    """What an engine is run by; installs what it needs."""
    if name == "supple":
        return [sys.executable, HERE / "supple.py", scene, out, program]
    if name == "rapier":
        manifest = HERE / "rapier/Cargo.toml"
        call("cargo", "build", "--release", "--quiet", "--locked", "--manifest-path", manifest, "--target-dir", TARGET / "rapier")
        return [sys.executable, HERE / "rapier.py", scene, out, TARGET / "rapier/release/rapier-peer"]
    script = {"mujoco": "mujoco_flex.py", "newton": "newton_vbd.py", "ngsolve": "taylor_hood.py"}[name]
    return [python(), HERE / script, scene, out]


def machine():
    info = Path("/proc/cpuinfo").read_text()
    name = re.search(r"model name\s*: (.*)", info)
    level = "AVX-512" if " avx512f" in info else "AVX2" if " avx2" in info else "no AVX2"
    return f"{name[1] if name else platform.machine()} with {level}; one thread; shared with other work"


def nu(row):
    """As the setting says it."""
    said = re.search(r"nu ([0-9.]+)", row["setting"])
    return said[1] if said else None


def rows(found, scene, date):
    """Rows of the table: errors, and the time over that of supple's cheapest setting, of the same nu or the scene's, that is no less accurate at rest and
    over the swing."""
    for row in found:
        if "failed" not in row:
            row["errors"] = errors(SCENES[scene], row["rest"], row["swing"])
            if max(row["errors"]) > 100:
                row["failed"] = f"unusable: off by {row['errors'][0]:.0f} % at rest, {row['errors'][1]:.0f} % over the swing"
    ours = [row for row in found if row["engine"] == "supple" and "failed" not in row]
    for row in found:
        line = {"scene": scene, **{name: row[name] for name in ("engine", "version", "setting", "mesh")}, "date": date, "machine": machine()}
        if "failed" in row:
            line["note"] = row["failed"]
        else:
            line["error_at_rest_percent"], line["error_of_swing_percent"] = (f"{error:.2f}" for error in row["errors"])
            line["processor_s_per_s"] = f"{row['seconds']:.4f}"
            same = [one for one in ours if nu(one) in (nu(row), f"{SCENES[scene].poisson:.3g}")]
            as_good = [one for one in same if all(a <= b for a, b in zip(one["errors"], row["errors"]))]
            if as_good:
                best = min(as_good, key=lambda one: one["seconds"])
                line["over_supple"] = f"{row['seconds'] / best['seconds']:.3g}"
                line["supple_no_less_accurate"] = f"{best['mesh']}; {best['setting']}"
            elif ours:
                line["note"] = "no setting of supple here is as accurate"
        yield line


def figure(number):
    """Two digits, without an exponent."""
    return f"{float(f'{float(number):.1e}'):g}"


def best(lines):
    """Without those of supple that swing off by more than 20 %, or than which another of the same nu is no less accurate and cheaper."""
    figures = ["error_at_rest_percent", "error_of_swing_percent", "processor_s_per_s"]

    def beaten(line):
        values = [float(line[name]) for name in figures]
        others = [[float(one[name]) for name in figures] for one in lines if one["engine"] == "supple" and one[figures[0]] and nu(one) == nu(line)]
        return any(other != values and all(a <= b for a, b in zip(other, values)) for other in others)

    return [line for line in lines if line["engine"] != "supple" or line[figures[0]] and float(line[figures[1]]) < 20 and not beaten(line)]


def table(lines, scene):
    right = truth(SCENES[scene])["error"]
    said = f"\n**Scene {scene.upper()}, {SCENES[scene].title}.** The truth's own error: about {figure(right[0])} % at rest, {figure(right[1])} % over the swing.\n\n"
    said += "| engine | setting | mesh | at rest | swing | s/s | over supple | supple, no less accurate |\n|---|---|---|---:|---:|---:|---:|---|\n"
    for line in best([line for line in lines if line["scene"] == scene]):
        engine = f"{line['engine']} {line['version']}" if line["engine"] != "supple" else "**supple**"
        if line["error_at_rest_percent"]:
            figures = [f"{figure(line[name])} %" for name in ("error_at_rest_percent", "error_of_swing_percent")]
            figures += [figure(line["processor_s_per_s"])]
            over = figure(line["over_supple"]) if line["over_supple"] else ""
            figures += ["", ""] if line["engine"] == "supple" else [over, line["supple_no_less_accurate"] or line["note"]]
        else:
            figures = ["", "", "", "", line["note"]]
        said += f"| {engine} | {line['setting']} | {line['mesh']} | {' | '.join(figures)} |\n"
    return said


def write(lines):
    with open(RESULTS, "w", newline="") as file:
        writer = csv.DictWriter(file, HEADS.split(","), restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(lines)
    with open(RESULTS, newline="") as file:
        lines = list(csv.DictReader(file))
    start, end = "<!-- peers: benches/peers/run.py writes these tables -->\n", "<!-- end of peers -->"
    before, rest = DOCS.read_text().split(start)
    _, after = rest.split(end)
    said = f"\n{lines[0]['date']}; {lines[0]['machine']}.\n" + "".join(table(lines, scene) for scene in SCENES)
    DOCS.write_text(before + start + said + end + after)


def check(found):
    """Supple's errors in scene B are those of results.csv."""
    with open(RESULTS, newline="") as file:
        kept = {(line["setting"], line["mesh"]): line for line in csv.DictReader(file) if line["scene"] == "b" and line["engine"] == "supple"}
    for line in rows(found, "b", ""):
        right = kept[line["setting"], line["mesh"]]
        for name in ("error_at_rest_percent", "error_of_swing_percent"):
            apart = abs(float(line[name]) - float(right[name]))
            print(f"{line['mesh']}, {line['setting']}: {name} {line[name]}, kept {right[name]}")
            if apart > 0.1 + 0.02 * float(right[name]):
                raise SystemExit("not what results.csv has")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--scene", choices=list(SCENES))
    arguments.add_argument("--quick", action="store_true", help="the first setting of each engine, kept nowhere")
    arguments.add_argument("--check", action="store_true", help="supple alone, in scene B, compared with results.csv")
    arguments.add_argument("--kept", action="store_true", help="take what engines have left in target/peers, if they have")
    arguments.add_argument("--only", default=",".join(ENGINES), help="engines, with commas")
    arguments.add_argument("--program", help="the command supple; built unless given")
    arguments = arguments.parse_args()
    program = arguments.program
    if not program:
        call("cargo", "build", "--release", "--quiet", cwd=ROOT)
        program = ROOT / "target/release/supple"
    program = Path(program).resolve()
    quick = arguments.quick or arguments.check
    scenes = ["b"] if arguments.check else [arguments.scene] if arguments.scene else list(SCENES)
    names = ["supple"] if arguments.check else arguments.only.split(",")
    TARGET.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, **ONE_THREAD, "WARP_CACHE_PATH": str(TARGET / "warp")}
    lines, date = [], datetime.date.today().isoformat()
    for scene in scenes:
        found = []
        for name in names:
            print(f"scene {scene}: {name}", flush=True)
            out = TARGET / f"{scene}-{name}{'-quick' if quick else ''}.json"
            try:
                if not (arguments.kept and out.exists()):
                    call(*command(name, program, scene, out), *["--quick"] * quick, env=environment, stdout=subprocess.DEVNULL)
                found += json.loads(out.read_text())
            except (subprocess.CalledProcessError, OSError) as error:
                blank = {"engine": name, "version": "", "setting": "", "mesh": ""}
                found.append({**blank, "failed": f"does not run: {error}"})
        if arguments.check:
            check(found)
            return
        lines += rows(found, scene, date)
    for line in lines:
        print(", ".join(f"{name} {line[name]}" for name in HEADS.split(",")[:11] if line.get(name)))
    if not arguments.quick and not arguments.scene and names == ENGINES:
        write(lines)


if __name__ == "__main__":
    main()
