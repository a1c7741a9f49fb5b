"""A MAVLink 2 link to PX4 over UDP, as far as a ground station needs it to watch a vehicle and fly a mission.

Messages and their CRC_EXTRA: https://mavlink.io/en/messages/common.html. Frames: https://mavlink.io/en/guide/serialization.html.
"""
import bisect
import socket
import struct
import time

# Name, CRC_EXTRA, and fields in the order of the wire, for the messages that are used here.
MESSAGES = {
    0: ("HEARTBEAT", 50, "<IBBBBB", ("custom_mode", "type", "autopilot", "base_mode", "system_status", "mavlink_version")),
    24: ("GPS_RAW_INT", 24, "<QiiiHHHHBBiIIIIH",
         ("time_usec", "lat", "lon", "alt", "eph", "epv", "vel", "cog", "fix_type", "satellites_visible",
          "alt_ellipsoid", "h_acc", "v_acc", "vel_acc", "hdg_acc", "yaw")),
    30: ("ATTITUDE", 39, "<Iffffff", ("time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")),
    33: ("GLOBAL_POSITION_INT", 104, "<IiiiihhhH",
         ("time_boot_ms", "lat", "lon", "alt", "relative_alt", "vx", "vy", "vz", "hdg")),
    40: ("MISSION_REQUEST", 230, "<HBBB", ("seq", "target_system", "target_component", "mission_type")),
    42: ("MISSION_CURRENT", 28, "<HHBB", ("seq", "total", "mission_state", "mission_mode")),
    44: ("MISSION_COUNT", 221, "<HBBB", ("count", "target_system", "target_component", "mission_type")),
    47: ("MISSION_ACK", 153, "<BBBB", ("target_system", "target_component", "type", "mission_type")),
    51: ("MISSION_REQUEST_INT", 196, "<HBBB", ("seq", "target_system", "target_component", "mission_type")),
    73: ("MISSION_ITEM_INT", 38, "<ffffiifHHBBBBBB",
         ("param1", "param2", "param3", "param4", "x", "y", "z", "seq", "command", "target_system", "target_component",
          "frame", "current", "autocontinue", "mission_type")),
    76: ("COMMAND_LONG", 152, "<fffffffHBBB",
         ("param1", "param2", "param3", "param4", "param5", "param6", "param7", "command", "target_system",
          "target_component", "confirmation")),
    77: ("COMMAND_ACK", 143, "<HB", ("command", "result")),
    230: ("ESTIMATOR_STATUS", 163, "<QffffffffH",
          ("time_usec", "vel_ratio", "pos_horiz_ratio", "pos_vert_ratio", "mag_ratio", "hagl_ratio", "tas_ratio",
           "pos_horiz_accuracy", "pos_vert_accuracy", "flags")),
    253: ("STATUSTEXT", 83, "<B50s", ("severity", "text")),
}
NUMBER_OF = {message[0]: number for number, message in MESSAGES.items()}
SYSTEM, COMPONENT = 255, 190    # of a ground station
ARMED = 0x80                    # of HEARTBEAT.base_mode
NAV_TAKEOFF, DO_SET_MODE, COMPONENT_ARM_DISARM = 22, 176, 400


def crc(data, extra):
    """CRC-16/MCRF4XX of the frame behind its first byte, and of the message's CRC_EXTRA."""
    value = 0xFFFF
    for byte in data + bytes([extra]):
        byte ^= value & 0xFF
        byte = (byte ^ (byte << 4)) & 0xFF
        value = (value >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
    return value & 0xFFFF


def frame(name, sequence, **values):
    """The bytes of a message; fields that are not given are 0."""
    number = NUMBER_OF[name]
    _, extra, layout, fields = MESSAGES[number]
    payload = struct.pack(layout, *(values.get(field, b"" if field == "text" else 0) for field in fields))
    payload = payload.rstrip(b"\0") or b"\0"
    head = struct.pack("<BBBBBB", len(payload), 0, 0, sequence & 0xFF, SYSTEM, COMPONENT) + number.to_bytes(3, "little")
    return b"\xFD" + head + payload + struct.pack("<H", crc(head + payload, extra))


def messages_of(data):
    """(name, values) of each known message of MAVLink 2 in a datagram whose checksum is right."""
    at = 0
    while at + 12 <= len(data):
        size = data[at + 1] + 12 + (13 if data[at + 2] & 1 else 0)
        if data[at] != 0xFD or at + size > len(data):
            at += 1
            continue
        number = int.from_bytes(data[at + 7:at + 10], "little")
        body = data[at + 1:at + 10 + data[at + 1]]
        if number in MESSAGES:
            name, extra, layout, fields = MESSAGES[number]
            if crc(body, extra) == struct.unpack_from("<H", data, at + len(body) + 1)[0]:
                payload = body[9:].ljust(struct.calcsize(layout), b"\0")
                yield name, dict(zip(fields, struct.unpack_from(layout, payload)))
        at += size


class Link:
    """Receives at `here` and sends to `there`, ports of 127.0.0.1. `latest` has the newest message of each name, `kept` all
    of the names in KEPT, with the times of PX4's clock at which they came [s]."""

    KEPT = ("GPS_RAW_INT", "ESTIMATOR_STATUS", "GLOBAL_POSITION_INT")

    def __init__(self, here, there):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", here))
        self.socket.setblocking(False)
        self.there, self.sequence, self.latest, self.texts, self.acks = there, 0, {}, [], {}
        self.now = 0.0
        self.changes = []    # times at which it was armed and disarmed, in turn
        self.kept = {name: ([], []) for name in self.KEPT}
        self.mission, self.mission_result, self.next_heartbeat = [], None, 0.0

    def close(self):
        self.socket.close()

    def send(self, name, **values):
        data = frame(name, self.sequence, **values)
        self.sequence += 1
        try:
            self.socket.sendto(data, ("127.0.0.1", self.there))
        except OSError:
            pass    # PX4 is not there yet, or not any more

    def serve(self):
        """Takes what has come, answers requests for items of the mission, and beats once a second."""
        if time.monotonic() >= self.next_heartbeat:
            self.next_heartbeat = time.monotonic() + 1
            self.send("HEARTBEAT", type=6, autopilot=8, mavlink_version=3)
        while True:
            try:
                data = self.socket.recv(65536)
            except OSError:
                return
            for name, values in messages_of(data):
                self.take(name, values)

    def take(self, name, values):
        self.latest[name] = values
        if "time_boot_ms" in values:
            self.now = values["time_boot_ms"] * 1e-3
        if name == "HEARTBEAT" and self.armed != bool(len(self.changes) % 2):
            self.changes.append(self.now)
        if name in self.KEPT:
            self.kept[name][0].append(self.now)
            self.kept[name][1].append(values)
        if name == "STATUSTEXT":
            self.texts.append(values["text"].split(b"\0")[0].decode(errors="replace"))
        elif name == "COMMAND_ACK":
            self.acks[values["command"]] = values["result"]
        elif name == "MISSION_ACK":
            self.mission_result = values["type"]
        elif name in ("MISSION_REQUEST", "MISSION_REQUEST_INT") and values["seq"] < len(self.mission):
            self.send("MISSION_ITEM_INT", seq=values["seq"], **self.mission[values["seq"]])

    def wait(self, condition, seconds):
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            self.serve()
            time.sleep(0.02)
        return condition()

    def upload(self, items, system):
        """Sends a mission; True if the vehicle took it."""
        self.mission = [dict(item, target_system=system, target_component=1) for item in items]
        for _ in range(5):
            self.mission_result = None
            self.send("MISSION_COUNT", count=len(items), target_system=system, target_component=1)
            if self.wait(lambda: self.mission_result is not None, 5):
                return self.mission_result == 0
        return False

    def command(self, command, system, *parameters):
        """Result of a command (0: accepted); None without an answer."""
        for attempt in range(3):
            self.acks.pop(command, None)
            self.send("COMMAND_LONG", command=command, target_system=system, target_component=1, confirmation=attempt,
                      **{f"param{i + 1}": value for i, value in enumerate(parameters)})
            if self.wait(lambda: command in self.acks, 3):
                return self.acks[command]
        return None

    @property
    def armed(self):
        return bool(self.latest.get("HEARTBEAT", {}).get("base_mode", 0) & ARMED)

    def armed_at(self, seconds):
        """Whether it was armed at a time of PX4's clock."""
        return bool(bisect.bisect_right(self.changes, seconds) % 2)


def read_mission(path):
    """Items of a file of waypoints ("QGC WPL 110"), without its home. Raises ValueError, which names file and line."""
    with open(path) as file:
        lines = file.read().splitlines()
    if not lines or not lines[0].startswith("QGC WPL"):
        raise ValueError(f"{path}:1: is no file of waypoints; its first line is 'QGC WPL 110'")
    items = []
    for number, line in enumerate(lines[1:], 2):
        cells = line.split()
        if not cells:
            continue
        try:
            index, current, mission_frame, command = (int(cell) for cell in cells[:4])
            parameters = [float(cell) for cell in cells[4:11]]
            if len(cells) != 12 or len(parameters) != 7:
                raise ValueError
        except ValueError:
            raise ValueError(f"{path}:{number}: a waypoint has 12 columns of numbers, separated by tabs") from None
        if index == 0:
            continue    # home
        items.append({"current": int(not items), "frame": {0: 5, 3: 6, 10: 11}.get(mission_frame, mission_frame),
                      "command": command, "param1": parameters[0], "param2": parameters[1], "param3": parameters[2],
                      "param4": parameters[3], "x": round(parameters[4] * 1e7), "y": round(parameters[5] * 1e7),
                      "z": parameters[6], "autocontinue": int(cells[11])})
    if not items:
        raise ValueError(f"{path}: contains no waypoint beside home")
    return items
