"""Mock of Webots' module (lib/controller/python/controller: supervisor.py, node.py, field.py, robot.py): metres in the
axes of WorldInfo.coordinateSystem, orientations as matrices by rows."""
import os

import course

AXES = os.environ.get("STAND_IN_AXES", "ENU")
ORDER = {"ENU": (0, 1, 2), "NUE": (1, 2, 0), "EUN": (0, 2, 1)}[AXES]


class Field:
    def __init__(self, name, value):
        self.name, self.value = name, value

    def getSFString(self):
        return self.value

    def getSFVec3f(self):
        return self.value

    def setSFString(self, value):
        course.log(f"{self.name} {value}")

    def getCount(self):
        return len(self.value)

    def getMFNode(self, index):
        return self.value[index]


class Node:
    def __init__(self, type_name, **fields):
        self.type_name, self.fields = type_name, fields

    def getTypeName(self):
        return self.type_name

    def getField(self, name):
        return Field(name, self.fields[name])

    def getPosition(self):
        return [self.now()[0][index] for index in ORDER]

    def getVelocity(self):
        return [self.now()[1][index] for index in ORDER] + [0.0, 0.0, 0.0]

    def getOrientation(self):
        return [axis[row] for row in range(3) for axis in course.axes()]


class Supervisor:
    def __init__(self):
        self.clock = course.Clock()
        self.node = Node("Robot", customData="")
        self.node.now = lambda: course.at(self.clock.time_s)
        self.root = Node("Group", children=[Node("WorldInfo", coordinateSystem=AXES, gpsCoordinateSystem="WGS84",
                                                        gpsReference=[*course.ORIGIN]), Node("Viewpoint"), self.node])

    def getSupervisor(self):
        return AXES != "ENU" or "STAND_IN_NO_SUPERVISOR" not in os.environ

    def getRoot(self):
        return self.root

    def getSelf(self):
        return self.node

    def getBasicTimeStep(self):
        return 16.0

    def getTime(self):
        return self.clock.time_s

    def step(self, time_step):
        self.clock.step(time_step / 1000)
        return 0 if self.clock.time_s <= course.SECONDS else -1
