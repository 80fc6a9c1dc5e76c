#!/usr/bin/env python3
"""Times arborloop's ray caster beside Embree 4 on the same scene and rays, interleaved, one core each.

A development tool: needs embreex 4 and numpy from PyPI and a C compiler. Nothing of it is shipped or linked.

    python3 -m venv /tmp/embree && /tmp/embree/bin/pip install 'embreex>=4' numpy
    /tmp/embree/bin/python tools/compare_embree.py --scene M

It exports the bench's scene, checks that Embree meets the same surfaces within 1 mm, then runs rounds: Embree's
single-ray query on the flat mesh, Embree's instances with sixteen coherent rays at a time, and our engine, which runs as
a served process. Every time is the CPU time of the process that casts. Ratios are taken per round, then the median.

Two measures of ours stand beside each way of Embree's: `find`, which answers what Embree answers, and `cast`, which
adds the exact hit in double precision.
"""

import argparse
import glob
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
DRIVER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "embree_driver.c")
WAYS = {"flat1": "Embree single ray, flat", "flat16": "Embree 16 coherent, flat",
        "inst1": "Embree single ray, instances", "inst16": "Embree 16 coherent, instances"}


def library():
    """The Embree library inside the embreex wheel."""
    import embreex

    folder = os.path.join(os.path.dirname(embreex.__file__), "..", "embreex.libs")
    found = sorted(glob.glob(os.path.join(folder, "libembree4*")))
    if not found:
        sys.exit(f"no libembree4 in {folder}: embreex 4 is wanted")
    return found[0]


def engine():
    """The bench's binary, built if need be."""
    command = ["cargo", "bench", "-q", "-p", "arborloop-sim", "--bench", "rays", "--no-run", "--message-format=json"]
    lines = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    for message in map(json.loads, lines):
        if message.get("executable") and message["target"]["name"] == "rays":
            return message["executable"]
    sys.exit("cargo names no executable of the bench `rays`")


class Served:
    """A process that casts all rays once for each line, and answers with its CPU seconds."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.greeting = self.process.stdout.readline().split()
        if self.greeting[:1] != ["ready"]:
            sys.exit(f"{command[0]} is not ready: {self.greeting}")

    def round(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def compare(ours, theirs, rays):
    """Rays that differ by more than 1 mm, and how many of them that is in a million."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    apart = np.abs(np.where(both, ours, 0.0) - np.where(both, theirs, 0.0))
    odd = (np.isfinite(ours) != np.isfinite(theirs)) | (apart > 1e-3)
    worst = np.max(apart[both & ~odd], initial=0.0)
    return int(odd.sum()), 1e6 * odd.sum() / rays, worst


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--scene", default="M", choices="SML")
    arguments.add_argument("--poses", default=4, type=int)
    arguments.add_argument("--rounds", default=7, type=int)
    arguments.add_argument("--isa", default="avx2", choices=["portable", "avx2", "avx512"])
    arguments.add_argument("--ways", default="flat1,inst16", help="of " + ", ".join(WAYS))
    arguments.add_argument("--engine", help="a bench binary that exists already")
    wanted = arguments.parse_args()
    binary = wanted.engine or engine()
    ways = wanted.ways.split(",")
    with tempfile.TemporaryDirectory() as folder:
        driver = os.path.join(folder, "driver")
        subprocess.run(["cc", "-O2", "-o", driver, DRIVER, "-ldl", "-lm"], check=True)
        flags = ["--scene", wanted.scene, "--poses", str(wanted.poses), "--isa", wanted.isa]
        subprocess.run([binary, *flags, "--export", folder], check=True)
        ours = Served([binary, *flags, "--serve"])
        rays, memory = int(ours.greeting[1]), int(ours.greeting[2])
        embree = Served([driver, library(), folder, wanted.ways])
        expected = np.fromfile(os.path.join(folder, "ranges.f32"), "<f4")
        print(f"scene {wanted.scene}, {rays} rays, ours {memory / 1e6:.1f} MB, {wanted.isa}")
        for way in ways:
            embree.round(way)
            found = np.fromfile(os.path.join(folder, "embree_ranges.f32"), "<f4")
            odd, ppm, worst = compare(expected, found, rays)
            print(f"  {WAYS[way]}: {odd} rays differ by more than 1 mm ({ppm:.0f} ppm), the others by {worst:.2g} m")
        mine = {"find": "the tracer: surface and distance in single precision, as Embree answers",
                "cast": "the whole call: the exact hit in double precision on top"}
        times = {name: [] for name in [*ways, *mine]}
        for measure in mine:
            ours.round(measure)
        for _ in range(wanted.rounds):
            for name in times:
                times[name].append(ours.round(name) if name in mine else embree.round(name))
        per_ray = {name: np.median(seconds) / rays * 1e9 for name, seconds in times.items()}
        for measure, meaning in mine.items():
            print(f"  ours, {measure}: {per_ray[measure]:.0f} ns a ray, {1e3 / per_ray[measure]:.2f} Mray/s ({meaning})")
        for way in ways:
            print(f"  {WAYS[way]}: {per_ray[way]:.0f} ns a ray")
            for measure in mine:
                ratios = np.array(times[way]) / np.array(times[measure])
                shown = " ".join(f"{ratio:.2f}" for ratio in ratios)
                print(f"    {measure} is faster {np.median(ratios):.2f} times [{shown}]")
        for process in [ours, embree]:
            process.close()


if __name__ == "__main__":
    main()
