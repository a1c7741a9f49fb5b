"""A MAVLink 2 link to PX4 over UDP, with the functions a ground station needs to monitor a vehicle and fly a mission.

Messages and their CRC_EXTRA: https://mavlink.io/en/messages/common.html. Frames: https://mavlink.io/en/guide/serialization.html.
"""
import bisect
import json
import math
import socket
import struct
import time

# Name, CRC_EXTRA, and fields in the order of the wire, for the messages used here.
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
NAV_TAKEOFF, DO_SET_MODE, DO_JUMP, COMPONENT_ARM_DISARM = 22, 176, 177, 400
FRAMES = {0: 5, 2: 2, 3: 6, 5: 5, 6: 6}    # of mission files, as in MISSION_ITEM_INT; PX4 accepts no others
MISSION_FRAME = 2               # of items without a position
NO_VALUE = 0x7FFFFFFF           # NaN in an integer of MISSION_ITEM_INT


def crc(data, extra):
    """CRC-16/MCRF4XX of the frame after its first byte, and of the message's CRC_EXTRA."""
    value = 0xFFFF
    for byte in data + bytes([extra]):
        byte ^= value & 0xFF
        byte = (byte ^ (byte << 4)) & 0xFF
        value = (value >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
    return value & 0xFFFF


def frame(name, sequence, **values):
    """The bytes of a message; missing fields are 0."""
    number = NUMBER_OF[name]
    _, extra, layout, fields = MESSAGES[number]
    payload = struct.pack(layout, *(values.get(field, b"" if field == "text" else 0) for field in fields))
    payload = payload.rstrip(b"\0") or b"\0"
    head = struct.pack("<BBBBBB", len(payload), 0, 0, sequence & 0xFF, SYSTEM, COMPONENT) + number.to_bytes(3, "little")
    return b"\xFD" + head + payload + struct.pack("<H", crc(head + payload, extra))


def messages_of(data):
    """(name, values) of each known message of MAVLink 2 in a datagram with a valid checksum."""
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
    with names in KEPT, with their arrival times on PX4's clock [s]."""

    KEPT = ("GPS_RAW_INT", "ESTIMATOR_STATUS", "GLOBAL_POSITION_INT")

    def __init__(self, here, there):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", here))
        self.socket.setblocking(False)
        self.there, self.sequence, self.latest, self.texts, self.acks = there, 0, {}, [], {}
        self.now = 0.0
        self.changes = []    # times at which it was armed and disarmed, alternating
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
            pass    # PX4 has not started, or has ended

    def serve(self):
        """Reads received messages, answers requests for mission items, and sends a heartbeat once per second."""
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
        """Sends a mission; True if the vehicle accepted it."""
        self.mission = [dict(item, target_system=system, target_component=1) for item in items]
        for _ in range(5):
            self.mission_result = None
            self.send("MISSION_COUNT", count=len(items), target_system=system, target_component=1)
            if self.wait(lambda: self.mission_result is not None, 5):
                return self.mission_result == 0
        return False

    def command(self, command, system, *parameters):
        """Result of a command (0: accepted); None without a response."""
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


def mission_item(where, command, mission_frame, parameters, autocontinue):
    """A MISSION_ITEM_INT; raises ValueError, beginning with `where`, for items that PX4 rejects or the message cannot hold."""
    if mission_frame not in FRAMES:
        raise ValueError(f"{where}: PX4 does not accept its frame {mission_frame}; use 0 (above sea level), 3 (above home) or 2 (no position)")
    has_position = mission_frame != MISSION_FRAME
    limits = (90, 180) if has_position else (2e9, 2e9)
    if any(math.isinf(value) for value in parameters) or any(abs(value) > limit for value, limit in zip(parameters[4:6], limits)):
        raise ValueError(f"{where}: a parameter is out of range; give four numbers, latitude and longitude [deg], height [m]")
    if has_position and any(math.isnan(value) for value in parameters[4:]):
        raise ValueError(f"{where}: has no latitude, longitude or height; set its position, and its height as a number")
    if not has_position and any(value % 1 for value in parameters[4:6] if not math.isnan(value)):
        raise ValueError(f"{where}: parameters 5 and 6 of an item without a position are integers in MAVLink")
    x, y = (NO_VALUE if math.isnan(value) else round(value * (1e7 if has_position else 1)) for value in parameters[4:6])
    return {"current": 0, "frame": FRAMES[mission_frame], "command": command, "param1": parameters[0], "param2": parameters[1],
            "param3": parameters[2], "param4": parameters[3], "x": x, "y": y, "z": parameters[6], "autocontinue": autocontinue}


def waypoint_rows(path, lines, log):
    """Rows of a file "QGC WPL 110": its location, its number and the arguments of mission_item(); without ArduPilot's home."""
    rows = []
    for number, line in enumerate(lines[1:], 2):
        cells = line.split()
        if not cells:
            continue
        try:
            index, _, mission_frame, command = (int(cell) for cell in cells[:4])
            if len(cells) != 12:
                raise ValueError
            rows.append((f"{path}:{number}", index, command, mission_frame, [float(cell) for cell in cells[4:11]], int(cells[11])))
        except ValueError:
            raise ValueError(f"{path}:{number}: a waypoint has 12 columns of numbers, separated by tabs") from None
        if index != rows[0][1] + len(rows) - 1 or rows[0][1] not in (0, 1):
            raise ValueError(f"{path}:{number}: its number is {index}; rows are numbered from 0 or 1: copy the missing ones")
    if len(rows) > 1 and rows[0][1:4] == (0, 16, 0):
        log(f"{path}: row 0 (command 16, frame 0: {rows[0][4][4]}, {rows[0][4][5]}) is taken as home and not flown")
        del rows[0]
    return rows


def plan_rows(path, text, log):
    """The same for a plan of QGroundControl (https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html)."""
    try:
        plan = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}:{error.lineno}: is not JSON ({error.msg}); save the plan again") from None
    mission = plan.get("mission")
    if plan.get("fileType") != "Plan" or not isinstance(mission, dict) or not isinstance(mission.get("items"), list):
        raise ValueError(f"{path}: is not a plan of QGroundControl (fileType 'Plan' and a mission with items); save it as .plan")
    rows = []
    for number, item in enumerate(mission["items"], 1):
        where = f"{path}: item {number}"
        if not isinstance(item, dict) or item.get("type") != "SimpleItem":
            kind = item.get("complexItemType", item.get("type")) if isinstance(item, dict) else item
            raise ValueError(f"{where}: the complex item '{kind}' is not supported; upload the plan to a vehicle in QGroundControl, "
                             "download it and save it: then it has waypoints")
        params = item.get("params")
        values = [math.nan if value is None else value for value in (params if isinstance(params, list) else ())]
        whole = [item.get(key, default) for key, default in (("doJumpId", number), ("command", None), ("frame", None))]
        if len(values) != 7 or any(type(value) not in (int, float) for value in values) or any(type(value) is not int for value in whole):
            raise ValueError(f"{where}: an item has command, frame and 7 params, which are numbers or null")
        # Heights in params are those of the frame; if the mode contradicts it, one of the two is wrong.
        mode = item.get("AltitudeMode")
        if whole[2] != MISSION_FRAME and whole[2] != {1: 3, 2: 0, 3: 0}.get(mode, whole[2]):
            raise ValueError(f"{where}: AltitudeMode {mode} and frame {whole[2]} contradict each other; set its height again")
        rows.append((where, *whole, values, int(item.get("autoContinue", True) is True)))
    if mission.get("plannedHomePosition"):
        log(f"{path}: its planned home {mission['plannedHomePosition']} is not used: PX4's home is its take-off position")
    lost = [f"{len(plan[part][key])} {name}" for part, key, name in
            (("geoFence", "circles", "circles of the geofence"), ("geoFence", "polygons", "polygons of the geofence"),
             ("rallyPoints", "points", "rally points")) if isinstance(plan.get(part), dict) and plan[part].get(key)]
    if lost:
        log(f"warning: {path}: not uploaded: {', '.join(lost)}")
    return rows


def read_mission(path, log=print):
    """Items of a file of waypoints ("QGC WPL 110") or of a plan of QGroundControl, without its home; `log` gets a line about
    home and about omitted parts. Raises ValueError, which names file and line or item."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        text = file.read()
    if text.lstrip().startswith("{"):
        rows = plan_rows(path, text, log)
    elif text.startswith("QGC WPL"):
        rows = waypoint_rows(path, text.splitlines(), log)
    else:
        raise ValueError(f"{path}:1: is not a mission; give a plan of QGroundControl, or waypoints, whose first line is 'QGC WPL 110'")
    if not rows:
        raise ValueError(f"{path}: contains no item")
    items = [mission_item(where, *row) for where, _, *row in rows]
    items[0]["current"] = 1
    # PX4 counts from 0 and without home.
    index_of = {number: index for index, (_, number, *_) in enumerate(rows)}
    for item, (where, *_) in zip(items, rows):
        if item["command"] == DO_JUMP:
            if item["param1"] not in index_of:
                raise ValueError(f"{where}: jumps to item {item['param1']:g}, which does not exist")
            item["param1"] = index_of[item["param1"]]
    return items
