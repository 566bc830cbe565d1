"""Streams a file to a GRBL controller by the package grbl-streamer, as its documentation says.

    python stream.py PORT FILE

Ends with status 0 when every line has been answered with `ok` and the machine stands; prints how many lines that were.
"""

import os
import re
import sys
import threading
import time

import serial
from grbl_streamer import GrblStreamer

BOOT_S = 120
PATIENCE_S = 1200

port, file = sys.argv[1:]
booted, stands, finished = (threading.Event() for _ in range(3))
processed, complaints, states = [], [], []


def callback(event, *data):
    if event == "on_boot":
        booted.set()
    elif event == "on_standstill":
        stands.set()
    elif event == "on_processed_command":
        processed.append(data)
    elif event in ("on_error", "on_alarm"):
        complaints.append((event, data))
        finished.set()
    elif event == "on_stateupdate":
        states.append(data)
    elif event == "on_job_completed":
        finished.set()


def await_report(line):
    """Returns when the controller has answered `?`: it has started, and its first greeting is behind it."""
    said, deadline = b"", time.monotonic() + BOOT_S
    while not re.search(rb"<[^>]*>", said):
        if time.monotonic() > deadline:
            sys.exit(f"the controller says nothing but {said}")
        line.write(b"?")
        said += line.read(200)


def await_or_end(what, happened):
    deadline = time.monotonic() + BOOT_S
    while not happened():
        if complaints or time.monotonic() > deadline:
            print(f"{what}, complaints: {complaints}", file=sys.stderr, flush=True)
            # The sender's threads would keep the program from ending.
            os._exit(1)
        time.sleep(0.05)


# A pseudo terminal may take a second to notice that it has been opened, and what is said until then is lost: it stays
# open beside the sender's own.
line = serial.Serial(port, 115200, timeout=1)
await_report(line)
grbl = GrblStreamer(callback)
# It resets the controller, once. A second reset could come due in the middle of the job.
grbl.cnect(port, 115200)
await_or_end("the controller does not boot", booted.is_set)
# It takes every `ok` for a line of the job, also those that answer the questions it asks after a start and at the first
# report. These must have come before the job begins, or it sends more than the controller can keep: they have when it says
# that the machine stands, after eleven reports that are the same.
grbl.poll_start()
await_or_end("the controller does not report", stands.is_set)
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
