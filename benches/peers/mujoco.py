"""The executed actions of recordings once more, in MuJoCo and in hilt, in turns: control steps per second on one core.

    pip install mujoco mcap-protobuf-support
    hilt plan --task stack --episodes 20 --out target/peer/plans.parquet
    hilt simulate --task stack --plans target/peer/plans.parquet --out target/peer/recordings
    python benches/peers/mujoco.py target/peer/recordings

Both get the same robot (the recording's own URDF: links, inertia, primitives, limits), blocks, torque limits, armature, damping and dry
friction, and the same joint velocities for 50 ms each; both do nothing else in between. The contact models differ, so the block ends
elsewhere: how far from where it was recorded is printed, beside hilt's own distance, which is 0.
"""

import argparse
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

CONTROL_DT_S = 0.05
# As src/sim/arm.rs: arm, then fingers.
ARMATURE, DAMPING, DRY_FRICTION = [0.2] * 6 + [0.005] * 3, [0.1] * 6 + [0.01] * 3, [0.0] * 6 + [0.6] * 3
# A velocity motor reaches its torque limit at this error [rad/s], which no command exceeds by much. A stiffer one is implicit in MuJoCo
# only below its limit: it flips between both limits and the arm stands still.
SATURATION_RAD_S = [0.6] * 6 + [0.8] * 3
# So a finger would be slowed by its dry friction: its command is raised by as much, unless it is one that stands still in hilt too.
STICTION_RAD_S = 0.12
# Dry friction nearly rigid: with the default (0.9) the thumb creeps open under the two fingers.
SOLIMP_FRICTION = "0.999 0.999 0.001"
HALF_EDGE_M, TABLE_HALF_M = 0.025, [1.5, 1.5, 0.25]
MASS_KG, FRICTION = 0.1, 1.0
HILT = "cargo bench --bench study -- replay --recordings"


def words(values):
    return " ".join(f"{v:.9g}" for v in values)


def numbers(text):
    return [float(word) for word in text.split()]


def child_pose(element):
    return {"pos": element.get("xyz", "0 0 0"), "euler": element.get("rpy", "0 0 0")}


def add_geoms(body, link):
    """The primitives of a link; a cylinder is a capsule (URDF has none: its two spheres are left out)."""
    common = {"contype": "1", "conaffinity": "2", "friction": f"{FRICTION} 0.005 0.0001"}
    for collision in link.findall("collision"):
        shape, pose = collision.find("geometry")[0], child_pose(collision.find("origin"))
        if shape.tag == "box":
            ET.SubElement(body, "geom", type="box", size=words(v / 2 for v in numbers(shape.get("size"))), **pose, **common)
        elif shape.tag == "cylinder":
            size = words([float(shape.get("radius")), float(shape.get("length")) / 2])
            ET.SubElement(body, "geom", type="capsule", size=size, **pose, **common)


def add_link(parent, name, robot, actuators):
    """The body of a link and all that hangs on it."""
    link = next(l for l in robot.findall("link") if l.get("name") == name)
    if link.find("inertial") is None:
        return
    hold = next((j for j in robot.findall("joint") if j.find("child").get("link") == name), None)
    body = ET.SubElement(parent, "body", name=name, gravcomp="1", **(child_pose(hold.find("origin")) if hold is not None else {}))
    inertial = link.find("inertial")
    moments = words(float(inertial.find("inertia").get(key)) for key in ("ixx", "iyy", "izz"))
    place, mass = inertial.find("origin").get("xyz"), inertial.find("mass").get("value")
    ET.SubElement(body, "inertial", pos=place, mass=mass, diaginertia=moments)
    if hold is not None:
        i = len(actuators)
        limit = hold.find("limit")
        limits = {"range": f"{limit.get('lower')} {limit.get('upper')}"} if hold.get("type") == "revolute" else {}
        motion = {"armature": str(ARMATURE[i]), "damping": str(DAMPING[i]), "frictionloss": str(DRY_FRICTION[i]),
                  "solimpfriction": SOLIMP_FRICTION}
        ET.SubElement(body, "joint", name=hold.get("name"), axis="0 0 1", **limits, **motion)
        effort = float(limit.get("effort"))
        motor = {"kv": str(effort / SATURATION_RAD_S[i]), "forcerange": f"{-effort} {effort}"}
        ET.SubElement(actuators, "velocity", joint=hold.get("name"), **motor)
    add_geoms(body, link)
    for joint in robot.findall("joint"):
        if joint.find("parent").get("link") == name:
            add_link(body, joint.find("child").get("link"), robot, actuators)


def model_of(urdf, blocks, dt, cone):
    """The scene in MJCF. Robot (1) meets the rest (2); the rest meets itself."""
    robot = ET.fromstring(urdf)
    root = ET.Element("mujoco")
    ET.SubElement(root, "compiler", angle="radian", eulerseq="XYZ", autolimits="true")
    option = {"timestep": str(dt), "integrator": "implicitfast", "cone": cone, "impratio": "10" if cone == "elliptic" else "1"}
    ET.SubElement(root, "option", **option)
    world, actuators = ET.SubElement(root, "worldbody"), ET.Element("actuator")
    rest = {"contype": "2", "conaffinity": "3", "friction": f"{FRICTION} 0.005 0.0001"}
    ET.SubElement(world, "geom", type="box", size=words(TABLE_HALF_M), pos=words([0, 0, -TABLE_HALF_M[2]]), **rest)
    add_link(world, robot.find("link").get("name"), robot, actuators)
    for i in range(blocks):
        block = ET.SubElement(world, "body", name=f"block_{i}")
        ET.SubElement(block, "freejoint")
        ET.SubElement(block, "geom", type="box", size=words([HALF_EDGE_M] * 3), mass=str(MASS_KG), **rest)
    root.append(actuators)
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def read(path):
    """The URDF and the steps of a recording."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        urdf = next(a.data.decode() for a in reader.iter_attachments() if a.name == "robot.urdf")
        return urdf, [message for _, _, _, message in reader.iter_decoded_messages(topics=["/hilt/step"])]


def free_joint(pose):
    x, y, z, w = pose.quaternion_xyzw
    return [*pose.position_m, w, x, y, z]


class Replay:
    """One recording in MuJoCo."""

    def __init__(self, urdf, steps, dt, cone):
        first, self.last = steps[0], steps[-1]
        poses = [body.pose for body in first.objects]
        self.model = model_of(urdf, len(poses), dt, cone)
        # The URDF lists joints as recordings do; MuJoCo's order is by depth, which for this arm is the same.
        self.data = mujoco.MjData(self.model)
        self.start = np.array([*first.q_rad, *(v for pose in poses for v in free_joint(pose))])
        executed = np.array([step.executed_rad_s for step in steps[:-1]])
        raised = np.sign(executed) * DRY_FRICTION / self.model.actuator_gainprm[:, 0]
        self.actions = list(executed + np.where(np.abs(executed) > STICTION_RAD_S, raised, 0.0))
        self.substeps = round(CONTROL_DT_S / dt)

    def run(self):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = self.start
        for action in self.actions:
            self.data.ctrl[:] = action
            mujoco.mj_step(self.model, self.data, nstep=self.substeps)
        return np.linalg.norm(self.data.qpos[9:12] - self.last.objects[0].pose.position_m)


def steps_per_s(replays):
    """Of three runs of each episode the fastest counts, as in hilt's replay."""
    best = [float("inf")] * len(replays)
    for _ in range(3):
        for i, replay in enumerate(replays):
            start = time.thread_time()
            replay.run()
            best[i] = min(best[i], time.thread_time() - start)
    return sum(len(replay.actions) for replay in replays) / sum(best)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("recordings", type=Path)
    arguments.add_argument("--dt", type=float, default=0.0125, help="MuJoCo's time step [s]")
    arguments.add_argument("--cone", choices=["elliptic", "pyramidal"], default="elliptic")
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--hilt", default=HILT, help="a command that takes the directory and prints steps per second")
    args = arguments.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    replays = [Replay(*read(path), args.dt, args.cone) for path in sorted(args.recordings.glob("*.mcap"))]
    if not replays:
        sys.exit(f"{args.recordings} holds no recording; run hilt simulate first")
    apart = [replay.run() for replay in replays]
    near = sum(distance < HALF_EDGE_M for distance in apart)
    print(f"MuJoCo {mujoco.__version__}, {args.dt} s, {args.cone}: {near} of {len(apart)} blocks end within "
          f"{HALF_EDGE_M} m of the recorded place, median {np.median(apart):.4f} m")
    best = [0.0, 0.0]
    for _ in range(args.rounds):
        best[0] = max(best[0], steps_per_s(replays))
        done = subprocess.run([*args.hilt.split(), str(args.recordings)], capture_output=True, text=True, check=True)
        best[1] = max(best[1], float(done.stdout.split()[-1]))
    print(f"control steps per second, best of {args.rounds} in turns: MuJoCo {best[0]:.0f}, hilt {best[1]:.0f}, "
          f"hilt / MuJoCo {best[1] / best[0]:.2f}")


if __name__ == "__main__":
    main()
