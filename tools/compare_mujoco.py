#!/usr/bin/env python3
"""Lets arborloop's walk balance a Go1 in MuJoCo, and sets what shakes there beside what shakes in our engine.

A development tool: needs mujoco 3.9 and numpy from PyPI. Nothing of it is shipped or linked.

    python3 -m venv /tmp/mujoco && /tmp/mujoco/bin/pip install 'mujoco==3.9.*' numpy
    /tmp/mujoco/bin/python tools/compare_mujoco.py

The bodies of MuJoCo are read from robots/models/go1.urdf; payload, rotors, friction, ground and first stance are told by
`cargo bench -p arborloop-sim --bench gait -- serve`, which then answers each state with torques, a thousand times a
second, and measures both walks with the same code. Exits with 1 when a measure is farther off than it may be.
"""

import argparse
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as xml

import mujoco
import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
URDF = os.path.join(ROOT, "robots", "models", "go1.urdf")
GRAVITY_MPS2 = 9.80665


def engine():
    """The bench's binary, built if need be."""
    command = ["cargo", "bench", "-q", "-p", "arborloop-sim", "--bench", "gait", "--no-run", "--message-format=json"]
    lines = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    for message in map(json.loads, lines):
        if message.get("executable") and message["target"]["name"] == "gait":
            return message["executable"]
    sys.exit("cargo names no executable of the bench `gait`")


def words(numbers):
    """Numbers as an attribute of MuJoCo's XML, to the last bit."""
    return " ".join(repr(float(number)) for number in numbers)


class Told:
    """What the bench says before a walk."""

    def __init__(self, lines):
        self.texts = {}
        for line in lines:
            name, _, rest = line.strip().partition(" ")
            if name == "ready":
                return
            self.texts[name] = rest
        sys.exit(f"the bench ended before it was ready, after {sorted(self.texts)}")

    def names(self, name):
        return self.texts[name].split()

    def numbers(self, name):
        return np.array([float(word) for word in self.names(name)])


def place(body, joint):
    """Puts a body where a joint of the URDF has it."""
    origin = joint.find("origin")
    body.set("pos", origin.get("xyz"))
    if any(float(angle) != 0.0 for angle in origin.get("rpy", "0 0 0").split()):
        sys.exit(f"joint {joint.get('name')} turns its child: this tool reads joints without rpy")


def weigh(body, link):
    """The inertial element of a link; MuJoCo orders a full inertia otherwise."""
    inertial = link.find("inertial")
    if inertial is None:
        return
    inertia = inertial.find("inertia")
    full = [inertia.get(name) for name in ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]]
    xml.SubElement(body, "inertial", pos=inertial.find("origin").get("xyz"),
                   mass=inertial.find("mass").get("value"), fullinertia=" ".join(full))


def hang(parent, name, robot, told, rotors, solref):
    """A link below its parent's element, and all that hangs on it."""
    link = next(link for link in robot.iter("link") if link.get("name") == name)
    weigh(parent, link)
    if name in told.names("feet"):
        sphere = link.find("collision/geometry/sphere")
        xml.SubElement(parent, "geom", name=name, type="sphere", size=sphere.get("radius"), condim="3", contype="0",
                       conaffinity="1", friction=f"{told.texts['friction']} 0 0", solref=solref)
    for joint in robot.findall("joint"):
        if joint.find("parent").get("link") != name:
            continue
        child = xml.SubElement(parent, "body", name=joint.find("child").get("link"))
        place(child, joint)
        if joint.get("type") == "revolute":
            limit, dynamics = joint.find("limit"), joint.find("dynamics")
            xml.SubElement(child, "joint", name=joint.get("name"), axis=joint.find("axis").get("xyz"),
                           range=f"{limit.get('lower')} {limit.get('upper')}", limited="true",
                           damping=dynamics.get("damping"), frictionloss=dynamics.get("friction"),
                           armature=repr(rotors[joint.get("name")]))
        hang(child, child.get("name"), robot, told, rotors, solref)


def model(told, solref):
    """The whole scene, compiled."""
    root = xml.Element("mujoco", model="go1")
    xml.SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="false")
    option = xml.SubElement(root, "option", timestep=told.texts["tick_s"], gravity=f"0 0 {-GRAVITY_MPS2}", cone="elliptic",
                            impratio="10", iterations="100", tolerance="1e-10")
    xml.SubElement(option, "flag", eulerdamp="enable")
    asset, world = xml.SubElement(root, "asset"), xml.SubElement(root, "worldbody")
    soil = {"name": "soil", "condim": "3", "contype": "1", "conaffinity": "0",
            "friction": f"{told.texts['friction']} 0 0", "solref": solref}
    heights = told.numbers("ground_m")
    low, high = told.numbers("ground_low_m"), told.numbers("ground_high_m")
    lowest, span = heights.min(), np.ptp(heights)
    if span == 0.0:
        xml.SubElement(world, "geom", type="plane", size="0 0 1", pos=f"0 0 {lowest}", **soil)
    else:
        columns = int(told.numbers("ground_columns")[0])
        half, middle = (high - low) / 2.0, (high + low) / 2.0
        xml.SubElement(asset, "hfield", name="field", nrow=str(len(heights) // columns), ncol=str(columns),
                       size=words([*half, span, 0.5]))
        xml.SubElement(world, "geom", type="hfield", hfield="field", pos=words([*middle, lowest]), **soil)
    robot = xml.parse(URDF).getroot()
    rotors = dict(zip(told.names("joints"), map(float, told.numbers("rotors_kgm2"))))
    base = xml.SubElement(world, "body", name="base_link")
    xml.SubElement(base, "freejoint", name="free")
    hang(base, "base_link", robot, told, rotors, solref)
    # A body of its own, fixed to the base; what has no mass in the URDF has none here.
    payload = xml.SubElement(base, "body", name="payload")
    inertia = told.numbers("payload_inertia_kgm2").reshape(3, 3)
    full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    xml.SubElement(payload, "inertial", pos=told.texts["payload_center_m"], mass=told.texts["payload_kg"],
                   fullinertia=words(full))
    made = mujoco.MjModel.from_xml_string(xml.tostring(root, encoding="unicode"))
    if span > 0.0:
        made.hfield_data[:] = (heights - lowest) / span
    return made


class Body:
    """The robot in MuJoCo: joints and feet in the bench's order."""

    def __init__(self, told, made):
        self.model, self.data = made, mujoco.MjData(made)
        joints = [made.joint(name) for name in told.names("joints")]
        self.angles = np.array([joint.qposadr[0] for joint in joints])
        self.rates = np.array([joint.dofadr[0] for joint in joints])
        self.feet = [made.geom(name).id for name in told.names("feet")]
        self.data.qpos[:3] = told.numbers("position_m")
        self.data.qpos[3:7] = np.roll(told.numbers("quaternion_xyzw"), 1)
        self.data.qpos[self.angles] = told.numbers("angles_rad")
        mujoco.mj_forward(made, self.data)

    def forces(self):
        """Size of the ground's force on each foot over the last step."""
        sums, wrench = np.zeros((4, 3)), np.zeros(6)
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            mujoco.mj_contactForce(self.model, self.data, index, wrench)
            foot = self.feet.index(next(geom for geom in contact.geom if geom in self.feet))
            sums[foot] += contact.frame.reshape(3, 3).T @ wrench[:3]
        return np.linalg.norm(sums, axis=1)

    def state(self):
        """As the bench wants it. MuJoCo gives a free body's velocity at its origin in world axes, its turn rate in its own."""
        data = self.data
        parts = [data.qpos[:3], np.roll(data.qpos[3:7], -1), data.qvel[:6], data.qpos[self.angles], data.qvel[self.rates],
                 self.forces()]
        return words(np.concatenate(parts))

    def step(self, torques):
        self.data.qfrc_applied[self.rates] = torques
        mujoco.mj_step(self.model, self.data)


def judged(binary, ground, seconds, solref):
    """One walk in each engine, printed; how many measures are off by more than they may be."""
    process = subprocess.Popen([binary, "serve", ground, str(seconds)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               text=True)
    told = Told(process.stdout)
    made = model(told, solref)
    body = Body(told, made)
    weight_kg = sum(made.body_mass)
    print(f"{ground}: {seconds:g} s, {weight_kg:.3f} kg, contacts of {solref.split()[0]} s in MuJoCo {mujoco.__version__}")
    off = 0
    process.stdin.write(body.state() + "\n")
    process.stdin.flush()
    for line in process.stdout:
        if line.startswith("torques"):
            body.step([float(word) for word in line.split()[1:]])
            process.stdin.write(body.state() + "\n")
            process.stdin.flush()
        elif line.startswith("fell"):
            print(f"  {line.strip()}")
            off += 1
        elif "|" in line:
            name, ours, theirs, most = (word.strip() for word in line.split("|"))
            ours, theirs, most = float(ours), float(theirs), float(most)
            apart = 100.0 * (ours / theirs - 1.0)
            bad = 0.0 < most < abs(apart)
            bar = f"bar {most:g} %: {'OFF' if bad else 'holds'}" if most else ""
            print(f"  {name:34} ours {ours:7.3f}   MuJoCo {theirs:7.3f}   {apart:+6.1f} %   {bar}")
            off += bad
    return off + (process.wait() != 0)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--grounds", default="flat,uneven", help="of flat (straight on) and uneven (3 cm, 5 deg, the rectangle)")
    arguments.add_argument("--seconds", default=20.0, type=float)
    arguments.add_argument("--contact-s", default=0.003, type=float, help="time constant of MuJoCo's contacts")
    arguments.add_argument("--engine", help="a bench binary that exists already")
    wanted = arguments.parse_args()
    binary = wanted.engine or engine()
    off = [judged(binary, ground, wanted.seconds, f"{wanted.contact_s} 1") for ground in wanted.grounds.split(",")]
    print("all bars hold" if sum(off) == 0 else f"{sum(off)} measures are off")
    sys.exit(int(sum(off) > 0))


if __name__ == "__main__":
    main()
