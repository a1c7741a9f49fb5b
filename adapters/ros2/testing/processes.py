"""Nodes, programs and subscribers of tests between real processes of ROS 2."""
import contextlib
import csv
import os
import signal
import subprocess
import tempfile
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

PREFIX = os.environ["CANYON_ROS2_PREFIX"]
CANYON = os.environ["CANYON_PROGRAM"]
PATIENCE = 60  # of a busy machine [s]

# On the surface of WGS 84 at 22.3 N, 114.17 E.
ORIGIN = {"city.origin.latitude_deg": 22.3, "city.origin.longitude_deg": 114.17}
OPEN_FIELD = {**ORIGIN, "city.open": True, "profile": "ideal", "sky.nominal": True, "start": "2026-06-01T08:00:00Z",
              "pose.source": "pose", "autostart": True}
DRIVE = """
city: {synthetic: {seed: 7}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
rate_hz: 10
duration_s: %s
trajectory:
  waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 150, up_m: 2}]
  speed_mps: 5
receivers: [{name: car, profile: paper}]
outputs: {pictures: false}
"""


def folder():
    return tempfile.TemporaryDirectory(prefix="canyon_ros2_")


def write_drive(path, seconds):
    path = os.path.join(path, "drive.yaml")
    with open(path, "w") as file:
        file.write(DRIVE % seconds)
    return path


def simulated(scenario, out):
    """The results of `canyon simulate` for the same scenario: rows of epochs.csv and of satellites.csv."""
    subprocess.run([CANYON, "simulate", scenario, "--out", out, "--quiet"], check=True)
    rows = []
    for name in ("epochs.csv", "satellites.csv"):
        with open(os.path.join(out, name)) as file:
            rows.append(list(csv.DictReader(file)))
    return rows


class Process:
    """A child with its output in a file, which ends with the test."""

    def __init__(self, command):
        self.log = tempfile.NamedTemporaryFile("w+", suffix=".log")
        self.child = subprocess.Popen(command, stdout=self.log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                                      start_new_session=True)

    def output(self):
        with open(self.log.name) as file:
            return file.read()

    def end(self):
        """As ctrl-C does; its exit status."""
        for how, seconds in ((signal.SIGINT, 10), (signal.SIGTERM, 5), (signal.SIGKILL, 5)):
            if self.child.poll() is not None:
                break
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.child.pid, how)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.child.wait(seconds)
        return self.child.returncode

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()


def parameters(values):
    words = []
    for name, value in values.items():
        if isinstance(value, bool):
            value = str(value).lower()
        words += ["-p", f"{name}:={value}"]
    return words


def receiver(values, *more):
    """The node as a process, found as `ros2 run` finds it."""
    return Process(["ros2", "run", "canyon_ros2", "receiver", "--ros-args", *parameters(values), *more])


def ros2(*words, check=True):
    done = subprocess.run(["ros2", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=PATIENCE)
    if check and done.returncode != 0:
        raise AssertionError(f"ros2 {' '.join(words)}: {done.stdout}")
    return done.stdout


def until(met, what, seconds=PATIENCE):
    end = time.monotonic() + seconds
    while not met():
        if time.monotonic() > end:
            raise AssertionError(f"waited {seconds} s for {what}")
        time.sleep(0.05)


class Listener:
    """A node of the test's own process, which is another one than the receiver's."""

    def __init__(self, **options):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("listener", context=self.context, **options)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def listen(self, kind, topic, reliable=False):
        """A list that grows."""
        received = []
        qos = QoSProfile(depth=500, durability=DurabilityPolicy.VOLATILE,
                         reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def spin_until(self, met, what, seconds=PATIENCE):
        end = time.monotonic() + seconds
        while not met():
            if time.monotonic() > end:
                raise AssertionError(f"waited {seconds} s for {what}")
            self.executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.01)

    def call(self, kind, name, request):
        client = self.node.create_client(kind, name)
        self.spin_until(client.service_is_ready, f"the service {name}")
        future = client.call_async(request)
        self.spin_until(future.done, f"the answer of {name}")
        self.node.destroy_client(client)
        return future.result()

    def transition(self, name, number):
        """True where the node goes that way (lifecycle_msgs/Transition)."""
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState
        return self.call(ChangeState, f"{name}/change_state",
                         ChangeState.Request(transition=Transition(id=number))).success

    def state(self, name):
        from lifecycle_msgs.srv import GetState
        return self.call(GetState, f"{name}/get_state", GetState.Request()).current_state.label

    def set_parameter(self, name, parameter, value):
        """The empty text, or why not."""
        from rcl_interfaces.srv import SetParameters
        request = SetParameters.Request(parameters=[Parameter(parameter, value=value).to_parameter_msg()])
        result = self.call(SetParameters, f"{name}/set_parameters", request).results[0]
        return "" if result.successful else result.reason


def seconds_of(stamp):
    return stamp.sec + stamp.nanosec * 1e-9
