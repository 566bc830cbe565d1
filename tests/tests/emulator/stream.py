"""Streams a file to a GRBL controller by the package grbl-streamer, as its documentation says.

    python stream.py PORT FILE

Ends with status 0 when every line has been answered with `ok` and the machine stands; prints how many lines that were.
"""

import sys
import threading
import time

from grbl_streamer import GrblStreamer

PATIENCE_S = 1200

port, file = sys.argv[1:]
booted, finished = threading.Event(), threading.Event()
processed, complaints, states = [], [], []


def callback(event, *data):
    if event == "on_boot":
        booted.set()
    elif event == "on_processed_command":
        processed.append(data)
    elif event in ("on_error", "on_alarm"):
        complaints.append((event, data))
        finished.set()
    elif event == "on_stateupdate":
        states.append(data)
    elif event == "on_job_completed":
        finished.set()


grbl = GrblStreamer(callback)
grbl.cnect(port, 115200)
# A pseudo terminal may take a second to notice that it has been opened.
for _ in range(30):
    if booted.wait(2):
        break
    grbl.softreset()
else:
    sys.exit("the controller does not boot")
time.sleep(1)
grbl.poll_start()
grbl.load_file(file)
lines = grbl.buffer_size
grbl.job_run()

deadline = time.monotonic() + PATIENCE_S
while not (grbl.job_finished and grbl.cmode == "Idle") and not complaints and time.monotonic() < deadline:
    time.sleep(0.1)
late = time.monotonic() >= deadline
grbl.disconnect()
print(f"{len(processed)} of {lines} lines processed, {len(states)} states, at {grbl.cmpos}")
if complaints or late or len(processed) != lines:
    sys.exit(f"complaints: {complaints}, out of time: {late}")
