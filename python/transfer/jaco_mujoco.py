"""Runs a policy of hilt on DeepMind's Jaco in MuJoCo: another arm model, another hand, another physics. Nothing is tuned.

The arm is the j2n6s300 of the `dm_control` wheel with the velocity actuators that dm_control gives it. Starts are those of an
evaluation by hilt, success is judged by the same conditions, written once more here. `docs/transfer.md` says what was measured.
"""

import argparse
import json
import multiprocessing
import os
from collections import deque
from pathlib import Path

import dm_control
import mujoco
import numpy as np
import onnxruntime
from checks import at_least, read_condition, read_policy, read_ready, read_starts

KINOVA = Path(dm_control.__file__).parent / "third_party/kinova"
ARM = [f"joint_{i}" for i in range(1, 7)]
# dm_control numbers fingers 2 and 3 the other way round.
FINGERS = ["hand/finger_1", "hand/finger_3", "hand/finger_2"]
MOST_VELOCITY = np.array([*np.deg2rad([36.0] * 3 + [48.0] * 3), 1.0, 1.0, 1.0])  # rad/s
# entities/manipulators/kinova/jaco_arm.py and jaco_hand.py of dm_control: gain [N m s/rad], torque [N m].
MOTORS = [(500.0, 30.5)] * 3 + [(500.0, 6.8)] * 3 + [(10.0, 1.0)] * 3
EDGE = 0.05  # m, of a cube
STEP = 0.002  # s, of the physics
CONTROL_HZ = 20
HOLD = CONTROL_HZ // 2  # steps that all conditions hold without a break
PRESS = 0.05  # N, from which on a finger presses
AT_REST = 0.01  # m/s
OFF_TABLE = 0.02  # m above its place at rest

# What may be another than in training, each a number or [low, high] to draw from for every episode. `delay` in control steps; noises are
# standard deviations, that on the commands in units of the paper's; `armature` and `gravity_compensation` in units of dm_control's.
NOMINAL = {
    "delay": 0, "observation_noise": 0, "action_noise": 1, "friction": 1, "mass": 0.1, "armature": 1, "gravity_compensation": 1,
}  # fmt: skip
PAPERS_NOISE = 0.001**0.5  # rad/s


def build(cubes):
    """The model: arm and hand as they come, a table, cubes."""
    spec = mujoco.MjSpec.from_file(str(KINOVA / "jaco_arm.xml"))
    spec.attach(mujoco.MjSpec.from_file(str(KINOVA / "jaco_hand.xml")), site=spec.site("wristsite"), prefix="hand/")
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # A pyramidal cone lets the cube slip out of the hand by more than a centimetre.
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10
    for body in spec.bodies[1:]:
        body.gravcomp = 1
    for joint, (gain, torque), most in zip(ARM + FINGERS, MOTORS, MOST_VELOCITY):
        actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_velocity(kv=gain)
        actuator.ctrlrange, actuator.forcerange = (-most, most), (-torque, torque)
    spec.worldbody.add_geom(name="table", type=mujoco.mjtGeom.mjGEOM_BOX, size=(1.5, 1.5, 0.25), pos=(0, 0, -0.25))
    # As in hilt, the block's friction counts against whatever it touches, and the base block's is 1.
    surface = {"block": {"priority": 1, "condim": 4}}
    for name in cubes:
        body = spec.worldbody.add_body(name=f"cube/{name}")
        body.add_freejoint(name=f"cube/{name}")
        edges = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [EDGE / 2] * 3}
        body.add_geom(name=f"cube/{name}", mass=NOMINAL["mass"], **edges, **surface.get(name, {}))
    return spec.compile()


class World:
    """One arm, a table and cubes, seen and commanded as hilt sees and commands its own."""

    def __init__(self, task, ready):
        self.task, self.ready = task, ready
        self.objects = ["block", "base"] if task == "stack" else ["block"]
        self.model = build(self.objects)
        self.data = mujoco.MjData(self.model)
        self.as_built = {key: getattr(self.model, key).copy() for key in ("body_mass", "body_inertia", "dof_armature")}
        joints = [self.model.joint(name) for name in ARM + FINGERS]
        self.q, self.dq = [j.qposadr[0] for j in joints], [j.dofadr[0] for j in joints]
        hand = [f"hand/finger_{part}_{i}" for i in (1, 3, 2) for part in ("knuckle", "tip")]
        self.finger = {self.model.geom(name).id: k // 2 for k, name in enumerate(hand)}
        self.cube = {name: self.model.geom(f"cube/{name}").id for name in self.objects}
        self.geom = {self.model.geom("table").id: "table"} | {geom: name for name, geom in self.cube.items()}

    def change(self, condition):
        """Friction, mass, armature and gravity compensation of the condition."""
        model, block = self.model, self.model.body("cube/block").id
        model.geom_friction[self.cube["block"], 0] = condition["friction"]
        for key in ("body_mass", "body_inertia"):
            getattr(model, key)[block] = self.as_built[key][block] * condition["mass"] / NOMINAL["mass"]
        model.dof_armature[self.dq] = self.as_built["dof_armature"][self.dq] * condition["armature"]
        robot = model.body_gravcomp > 0
        model.body_gravcomp[robot] = max(condition["gravity_compensation"], 1e-9)  # of a 0 there is no way back
        mujoco.mj_setConst(model, self.data)

    def reset(self, start):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.q] = self.ready
        for name in self.objects:
            half = start.get(f"{name}.yaw_rad", 0.0) / 2
            place = [start[f"{name}.x_m"], start[f"{name}.y_m"], EDGE / 2]
            self.data.joint(f"cube/{name}").qpos = [*place, np.cos(half), 0, 0, np.sin(half)]
        mujoco.mj_forward(self.model, self.data)
        self.goal = [start["goal.x_m"], start["goal.y_m"], EDGE / 2] if self.task == "pick-and-place" else []
        self.fixed = self.pose("base") if self.task == "stack" else self.goal
        self.quaternion = self.pose("block")[3:]
        self.carried, self.held = False, 0

    def pose(self, name):
        """Position, quaternion x y z w."""
        x, y, z, qw, qx, qy, qz = self.data.joint(f"cube/{name}").qpos
        return np.array([x, y, z, qx, qy, qz, qw])

    def state(self):
        """A state row of hilt: joint angles, joint velocities, the block, and what stays: goal or base as they were at the start."""
        block = self.pose("block")
        block[3:] *= 1 if block[3:] @ self.quaternion >= 0 else -1
        self.quaternion = block[3:]
        return np.concatenate([self.data.qpos[self.q], self.data.qvel[self.dq], block, self.fixed])

    def step(self, command):
        self.data.ctrl[:] = command
        mujoco.mj_step(self.model, self.data, round(1 / (CONTROL_HZ * STEP)))

    def touches(self):
        """Normal force of each finger on the block [N], and what else touches it."""
        fingers, others, force = np.zeros(3), set(), np.zeros(6)
        block = self.cube["block"]
        for i, contact in enumerate(self.data.contact):
            pair = {contact.geom1, contact.geom2}
            if block not in pair:
                continue
            (other,) = pair - {block}
            mujoco.mj_contactForce(self.model, self.data, i, force)
            if other in self.finger and force[0] > 0:
                fingers[self.finger[other]] += force[0]
            elif other in self.geom and force[0] > 0:
                others.add(self.geom[other])
        return fingers, others

    def success(self):
        """Whether all that the task asks for has held for half a second."""
        fingers, others = self.touches()
        block, speed = self.pose("block")[:3], np.linalg.norm(self.data.joint("cube/block").qvel[:3])
        self.gripped = bool(fingers[0] > PRESS and max(fingers[1:]) > PRESS)
        self.carried |= self.gripped and block[2] > EDGE / 2 + OFF_TABLE
        let_go = not fingers.any() and speed < AT_REST
        if self.task == "pick-up":
            met = block[2] >= 0.20 and self.gripped
        elif self.task == "pick-and-place":
            met = np.linalg.norm(block - self.goal) < 0.05 and let_go and "table" in others
        else:
            above = block - self.pose("base")[:3]
            aligned = np.hypot(*above[:2]) < EDGE / 2 and abs(above[2] - EDGE) < 0.01
            met = aligned and let_go and "base" in others and "table" not in others
        self.held = self.held + 1 if met and self.carried else 0
        return self.held >= HOLD


def episode(number):
    """An episode, which depends on nothing but condition, seed and number: whether it was solved, its steps, its last moment."""
    rng = np.random.default_rng([SEED, number])
    condition = {key: rng.uniform(*value) if isinstance(value, list) else value for key, value in CONDITION.items()}
    WORLD.change(condition)
    WORLD.reset(STARTS[number])
    pending = deque([np.zeros(9)] * round(condition["delay"]))
    for step in range(HORIZON + 1):
        if WORLD.success() or step == HORIZON or WORLD.pose("block")[2] < -0.1:
            break
        row = WORLD.state()
        # Angles and positions are off by so many rad and m, velocities by ten times as many rad/s.
        row[:21] += condition["observation_noise"] * rng.standard_normal(21) * np.repeat([1.0, 10.0, 1.0], [9, 9, 3])
        action = POLICY.run(["action"], {"state": row[None].astype(np.float32)})[0][0]
        pending.append(np.clip(action, -MOST_VELOCITY, MOST_VELOCITY))
        WORLD.step(pending.popleft() + condition["action_noise"] * PAPERS_NOISE * rng.standard_normal(9))
    end = {"gripped": WORLD.gripped, "block_m": WORLD.pose("block")[:3].round(4).tolist()}
    return {"success": WORLD.held >= HOLD, "steps": step, **end}


def begin(policy, task, ready, starts, condition, horizon, seed):
    """What every process has once."""
    global WORLD, POLICY, CONDITION, STARTS, HORIZON, SEED
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    POLICY = onnxruntime.InferenceSession(policy, options)
    WORLD, CONDITION, STARTS, HORIZON, SEED = World(task, ready), condition, starts, horizon, seed


def evaluate(policy, starts, robot, condition, episodes, seed=0, jobs=os.cpu_count()):
    """Rows of the first `episodes` episodes of `starts` with a policy (ONNX) under a condition (what it leaves out is nominal)."""
    about = read_policy(policy)
    starts = read_starts(starts, about["task"])[:episodes]
    given = (policy, about["task"], read_ready(robot), starts, NOMINAL | condition, int(about["horizon_steps"]), seed)
    with multiprocessing.Pool(jobs, begin, given) as pool:
        return pool.map(episode, range(len(starts)), chunksize=5)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("policy", help="a policy of pick-up, pick-and-place or stack as `hilt export onnx` writes it")
    parser.add_argument("--starts", required=True, help="NAME.episodes.parquet of `hilt evaluate --out NAME.json`")
    parser.add_argument("--robot", required=True, help="pipelines/robots/jaco.toml: the pose in which episodes begin")
    parser.add_argument("--episodes", type=at_least(1), default=500, help="no more than there are starts")
    parser.add_argument("--seed", type=at_least(0), default=0)
    parser.add_argument("--jobs", type=at_least(1), default=os.cpu_count())
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help=f"a condition: {', '.join(NOMINAL)}")
    parser.add_argument("--out", help="write a row an episode to this JSON file")
    args = parser.parse_args()
    condition = read_condition(args.set, NOMINAL)
    rows = evaluate(args.policy, args.starts, args.robot, condition, args.episodes, args.seed, args.jobs)
    print(f"{sum(row['success'] for row in rows)} of {len(rows)} solved, {condition or 'nominal'}")
    if args.out:
        Path(args.out).write_text(json.dumps({"condition": NOMINAL | condition, "episodes": rows}, indent=1))


if __name__ == "__main__":
    main()
