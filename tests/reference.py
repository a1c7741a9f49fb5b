#!/usr/bin/env python3
"""The generated pages of docs/reference/.

    reference.py                 checks messages.md; C++ tests check the other pages
    reference.py --write BUILD   writes all pages; the tests in the build folder BUILD write the other pages
"""
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/reference/messages.md"
FILES = [("protobuf", "## Gazebo transport and binary streams", "adapters/common/msgs/gnss.proto")] + [
    ("", f"## canyon_msgs/{name}", f"adapters/ros/canyon_msgs/msg/{name}.msg")
    for name in ("GnssSatellites", "GnssSatellite", "GnssMultipath", "GnssRawObservations", "GnssRawObservation")]
HEAD = """# Canyon's messages

*Generated: `tests/reference.py --write BUILD` writes this page from the definitions; a test fails if it is stale.*

[gz_sim.md](../gz_sim.md), [ros.md](../ros.md) and [ros2.md](../ros2.md) list the topics. Messages of other definitions (NMEA, MAVLink, RTCM, UBX,
SBF) are in [outputs.md](../outputs.md).
"""


def messages():
    parts = [HEAD]
    for language, heading, path in FILES:
        parts.append(f"{heading}\n\nOf [`{path}`](../../{path}):\n\n```{language}\n{(ROOT / path).read_text()}```\n")
    return "\n".join(parts)


def main():
    if sys.argv[1:2] == ["--write"] and len(sys.argv) == 3:
        PAGE.write_text(messages())
        for program in ("outputs_encoding", "simulation_scenario", "analysis_study", "analysis_validation", "adapters", "ros2"):
            subprocess.run([pathlib.Path(sys.argv[2]) / f"bin/test_{program}", "--gtest_filter=*DocumentationHasTheSameTable*",
                            "--gtest_brief=1"], env={**os.environ, "CANYON_WRITE_REFERENCE": "1"}, check=True)
        return 0
    if sys.argv[1:]:
        sys.exit(__doc__)
    if PAGE.read_text() != messages():
        sys.exit(f"{PAGE} is stale: tests/reference.py --write BUILD")
    return 0


if __name__ == "__main__":
    sys.exit(main())
