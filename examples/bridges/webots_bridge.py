#!/usr/bin/env python3
"""Webots R2022a and later: a supervisor controller that adds a GNSS receiver to its robot.

    canyon live town.yaml &
    # in the world: Robot { supervisor TRUE  controller "<extern>" }
    WEBOTS_CONTROLLER_URL=ROBOT_NAME $WEBOTS_HOME/webots-controller webots_bridge.py

or copy webots_bridge.py and canyon_bridge.py to controllers/webots_bridge/ of the project, with the field controller
"webots_bridge" and options in controllerArgs. For a robot with its own controller, add a second Robot with this
controller as its child: it follows the first. Each fix is a line in the console, and the same line in the robot's
field customData, for controllers. position_m is in the axes of WorldInfo.coordinateSystem (ENU,
NUE or EUN), in metres, like the GPS node's with gpsCoordinateSystem "local" and no gpsReference.
"""
import json

import canyon_bridge


def world_info(robot):
    nodes = robot.getRoot().getField("children")
    for index in range(nodes.getCount()):
        node = nodes.getMFNode(index)
        if node.getTypeName() == "WorldInfo":
            return node
    raise canyon_bridge.BridgeError("the world has no WorldInfo")


def main():
    parser = canyon_bridge.parser(__doc__, None)
    arguments = parser.parse_args()
    controller = canyon_bridge.need("controller", "Let Webots start this file, or webots-controller: see --help.")
    robot = controller.Supervisor()
    if not robot.getSupervisor():
        raise canyon_bridge.BridgeError("set the robot's field 'supervisor' to TRUE")
    world = world_info(robot)
    arguments.axes = arguments.axes or world.getField("coordinateSystem").getSFString()
    bridge = canyon_bridge.Bridge.of(arguments)
    if world.getField("gpsCoordinateSystem").getSFString() == "WGS84":  # then the reference is the world's origin
        bridge.state_place(world.getField("gpsReference").getSFVec3f(), (0, 0, 0))
    node, step_ms = robot.getSelf(), int(robot.getBasicTimeStep())
    custom_data = node.getField("customData")
    while robot.step(step_ms) != -1:
        m = node.getOrientation()  # rows of a matrix whose columns are the robot's axes: x forward, y left, z up
        flu = {"forward": m[0::3], "up": m[2::3]} if arguments.axes == "ENU" else {}  # other worlds have other body axes
        bridge.send(robot.getTime(), node.getPosition(), node.getVelocity()[:3], **flu)
        for fix in bridge.fixes():
            bridge.report(fix)
            custom_data.setSFString(json.dumps({"kind": fix.kind, "position_m": fix.position_m, "place": fix.place}))


if __name__ == "__main__":
    canyon_bridge.run(main)
