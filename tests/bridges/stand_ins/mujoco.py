"""Stand-in of MuJoCo's module: qpos of a free joint is x, y, z and a quaternion w, x, y, z, its qvel begins with the
velocity in the world; a body with a hinge is in front of it. userdata keeps what is written to it."""
import course

BODIES = ("world", "door", "drone")


class mjtJoint:
    mjJNT_FREE, mjJNT_HINGE = 0, 3


class Body:
    def __init__(self, name):
        if name not in BODIES:
            raise KeyError(f"Invalid name '{name}'. Valid names: {list(BODIES)}")
        self.id = BODIES.index(name)


class MjModel:
    njnt, jnt_type, jnt_bodyid = 2, (mjtJoint.mjJNT_HINGE, mjtJoint.mjJNT_FREE), (1, 2)
    jnt_qposadr, jnt_dofadr, nuserdata = (0, 1), (0, 1), 5

    @classmethod
    def from_xml_path(cls, path):
        with open(path):
            return cls()

    def body(self, name):
        return Body(name)


class MjData:
    def __init__(self, model):
        self.clock, self.userdata, self.time = course.Clock(), 5 * [0.0], 0.0
        self.qpos, self.qvel = [0.5] + 7 * [0.0], 7 * [0.0]


def mj_step(model, data):
    if any(data.userdata):
        course.log(" ".join(map(str, data.userdata)))
        data.userdata[:] = 5 * [0.0]  # so that each fix is logged once
    data.clock.step(0.005)
    data.time = data.clock.time_s
    position, velocity = course.at(data.time)
    data.qpos[1:] = position + list(course.quaternion(course.YAW_DEG, -course.PITCH_DEG, course.ROLL_DEG))  # z up, y left
    data.qvel[1:4] = velocity
