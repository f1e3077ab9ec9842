"""Read the `.tlog` of a flight with pymavlink: message rates, modes and texts.

A `.tlog` holds MAVLink in both directions; 8 bytes of time precede each frame. MAVProxy and
QGroundControl replay it; this program reads it in Python.

Run: python examples/read_tlog.py [FOLDER]
"""

from collections import Counter

from pymavlink import mavutil
from recorded import flight_folder

log = mavutil.mavlink_connection(str(flight_folder() / "flight.tlog"), dialect="common")
counts: Counter[str] = Counter()
first = last = mode = None
while (message := log.recv_match()) is not None:
    first, last = first or message._timestamp, message._timestamp
    counts[message.get_type()] += 1
    if message.get_type() == "HEARTBEAT" and message.autopilot != 8:  # 8: not an autopilot
        now = mavutil.mode_string_v10(message), bool(message.base_mode & 128)
        if now != mode:
            print(f"{last - first:6.1f} s  mode {now[0]}, {'armed' if now[1] else 'not armed'}")
            mode = now
    elif message.get_type() == "STATUSTEXT":
        print(f"{last - first:6.1f} s  {message.text}")
print(f"\n{last - first:.1f} s, {sum(counts.values())} messages:")
for name, count in counts.most_common(8):
    print(f"  {name:<24} {count:6d}  {count / (last - first):6.1f} Hz")
