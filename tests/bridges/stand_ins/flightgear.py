"""Stand-in of FlightGear's generic protocol (src/Network/generic.cxx): ASCII lines by the chunks of an XML file, out of
the property tree and into it. Runs in the test's process."""
import socket
import threading
import xml.etree.ElementTree

import course

FOOT_M = 0.3048


class FlightGear:
    def __init__(self, protocol, out_port, in_port, place):
        """@param place function of ENU [m]: latitude, longitude [deg], height [m]"""
        generic = xml.etree.ElementTree.parse(protocol).getroot().find("generic")
        self.out, self.into = ([chunk for chunk in generic.find(name).iter("chunk")] for name in ("output", "input"))
        for name in ("output", "input"):
            assert generic.find(name).findtext("line_separator") == "newline"
            assert generic.find(name).findtext("var_separator") == ","
        self.to, self.place, self.ended, self.fixes = ("127.0.0.1", out_port), place, False, []
        self.waited_s = 0.0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", in_port))
        self.socket.setblocking(False)
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def tree(self, time_s):
        # It drives off when it has a fix: the bridge may begin late.
        self.waited_s = self.waited_s if self.fixes else time_s
        position, _ = course.at(time_s - self.waited_s)
        latitude, longitude, height = self.place(position)
        return {"/sim/time/elapsed-sec": time_s, "/position/latitude-deg": latitude, "/position/longitude-deg": longitude,
                "/position/altitude-ft": height / FOOT_M, "/orientation/heading-deg": 90 - course.YAW_DEG,
                "/orientation/pitch-deg": course.PITCH_DEG, "/orientation/roll-deg": course.ROLL_DEG}

    def run(self):
        clock = course.Clock()
        while not self.ended:
            tree = self.tree(clock.time_s)
            line = ",".join(chunk.findtext("format") % tree[chunk.findtext("node")] for chunk in self.out) + "\n"
            self.socket.sendto(line.encode(), self.to)
            clock.step(0.02)
            while True:
                try:
                    received = self.socket.recv(4096)
                except BlockingIOError:
                    break
                self.take(received.decode())

    def take(self, line):
        assert line.endswith("\n"), line
        kinds = {"int": int, "double": float, "string": str}
        cells = line[:-1].split(",")
        assert len(cells) == len(self.into), line
        self.fixes.append({chunk.findtext("node"): kinds[chunk.findtext("type")](cell)
                           for chunk, cell in zip(self.into, cells)})

    def end(self):
        self.ended = True
        self.thread.join()
        self.socket.close()
