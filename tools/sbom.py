#!/usr/bin/env python3
"""Writes what a build of a package consists of, as CycloneDX 1.6 (JSON) on the standard output, for makers of medical software:

    tools/sbom.py [PACKAGE [FEATURES]]

PACKAGE is `supple` unless it is given, or `supple-cli` or another of the workspace; FEATURES as cargo has them: the wheel is of
`supple capi,io,parallel`. Components are the crates that are linked on this machine's processor, each with its licence, its checksum at crates.io
and what it depends on; those of tests and procedural macros are not, and Rust's standard library is none.
"""

import json
import pathlib
import re
import subprocess
import sys
import tomllib
import uuid

ROOT = pathlib.Path(__file__).resolve().parents[1]


def told(*command: str) -> str:
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"failed: {' '.join(command)}")
    return done.stdout


def main() -> None:
    if len(sys.argv) > 3 or any(word.startswith("-") for word in sys.argv[1:]):
        sys.exit("usage: tools/sbom.py [PACKAGE [FEATURES]]")
    package, features = sys.argv[1] if len(sys.argv) > 1 else "supple", sys.argv[2] if len(sys.argv) > 2 else ""
    tree = told("cargo", "tree", "--locked", f"--package={package}", f"--features={features}", "--edges=normal,no-proc-macro", "--no-dedupe",
                "--prefix=depth", "--format=\t{p}\t{l}")
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    checksums = {(each["name"], each["version"]): each["checksum"] for each in lock if "checksum" in each}
    components: dict[str, dict] = {}
    needed: dict[str, set[str]] = {}
    above: list[str] = []
    for line in tree.splitlines():
        depth, crate, licence = line.split("\t")
        name, version = re.match(r"(\S+) v(\S+)", crate).groups()
        place = f"pkg:cargo/{name}@{version}"
        components[place] = {"type": "library", "bom-ref": place, "name": name, "version": version, "purl": place,
                             "licenses": [{"expression": licence.replace("/", " OR ")}]}
        if checksum := checksums.get((name, version)):
            components[place]["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        needed.setdefault(place, set())
        above[int(depth) :] = [place]
        if len(above) > 1:
            needed[above[-2]].add(place)
    host = re.search(r"^host: (.*)", told("rustc", "-vV"), flags=re.M).group(1)
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": components.pop(above[0]),
            "properties": [{"name": "cargo:features", "value": features}, {"name": "cargo:target", "value": host}],
        },
        "components": [components[place] for place in sorted(components)],
        "dependencies": [{"ref": place, "dependsOn": sorted(needed[place])} for place in sorted(needed)],
    }
    # The same for the same contents.
    bill["serialNumber"] = f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(bill, sort_keys=True))}"
    json.dump(bill, sys.stdout, indent=1)
    print()


main()
