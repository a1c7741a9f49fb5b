#!/usr/bin/env python3
"""MuJoCo 2.3 and later: the GNSS receiver of a body with a free joint.

    canyon live town.yaml &
    python3 mujoco_bridge.py model.xml --body drone --userdata 0 --at 0,0,20

steps the model in real time. In a loop of your own, as with a viewer or a policy, call a Receiver after each mj_step:

    receiver = mujoco_bridge.Receiver(mujoco, model, canyon_bridge.Bridge(at=(0, 0, 20)), "drone", 0)
    mujoco.mj_step(model, data); receiver.update(data)

Each line is a fix; position_m is x, y, z of the world, in metres: x east, y north, z up (--axes for others). With --userdata
the fix is written to data.userdata as well, three values from that index on, which keep it until the next one and are NaN
without a fix; the model needs <size nuserdata="3"/>. (User sensors forget at each step.) Needs the module mujoco.
"""
import time

import canyon_bridge


class Receiver:
    def __init__(self, mujoco, model, bridge, body=None, userdata=None):
        """@param body with a free joint; without a name the first that has one; userdata is the index of the fix"""
        self.bridge, self.userdata = bridge, userdata
        if userdata is not None and not 0 <= userdata <= model.nuserdata - 3:
            raise canyon_bridge.BridgeError(f"no room for a fix at {userdata} of {model.nuserdata} userdata: "
                                            f"write <size nuserdata=\"{max(userdata, 0) + 3}\"/> into the model")
        try:
            free = [joint for joint in range(model.njnt) if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
                    and (body is None or model.jnt_bodyid[joint] == model.body(body).id)]
        except KeyError as error:  # MuJoCo's, which lists the names
            raise canyon_bridge.BridgeError(f"model: {error.args[0]}") from error
        if not free:
            raise canyon_bridge.BridgeError("no free joint in " + (f"the body '{body}'" if body else "the model"))
        self.qpos, self.qvel = model.jnt_qposadr[free[0]], model.jnt_dofadr[free[0]]

    def update(self, data):
        # qpos is of data.time; xpos and xquat are a step older after mj_step().
        qpos = data.qpos[self.qpos:self.qpos + 7]  # x, y, z, and w, x, y, z: body to world
        turn = [float(each) for each in qpos[3:]]
        self.bridge.send(data.time, qpos[:3], data.qvel[self.qvel:self.qvel + 3],
                         canyon_bridge.rotated(*turn, (1, 0, 0)), canyon_bridge.rotated(*turn, (0, 0, 1)))
        for fix in self.bridge.fixes():
            self.bridge.report(fix)
            if self.userdata is not None:
                data.userdata[self.userdata:self.userdata + 3] = fix.position_m or [float("nan")] * 3


def main():
    parser = canyon_bridge.parser(__doc__)
    parser.add_argument("model", help="an MJCF file")
    parser.add_argument("--body", help="with a free joint (the first)")
    parser.add_argument("--userdata", type=int, metavar="INDEX", help="of data.userdata that takes fixes")
    parser.add_argument("--speed", type=canyon_bridge.positive, default=1.0,
                        help="seconds of the simulation in one of real time (1)")
    parser.add_argument("--seconds", type=canyon_bridge.positive, default=float("inf"),
                        help="of the simulation, then end (for ever)")
    arguments = parser.parse_args()
    mujoco = canyon_bridge.need("mujoco", "Install it: pip install mujoco")
    model = mujoco.MjModel.from_xml_path(arguments.model)
    data = mujoco.MjData(model)
    receiver = Receiver(mujoco, model, canyon_bridge.Bridge.of(arguments), arguments.body, arguments.userdata)
    begin = time.monotonic()
    while data.time < arguments.seconds:
        mujoco.mj_step(model, data)
        receiver.update(data)
        time.sleep(max(0.0, begin + data.time / arguments.speed - time.monotonic()))


if __name__ == "__main__":
    canyon_bridge.run(main)
