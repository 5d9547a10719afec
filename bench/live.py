"""`dqwatch live` under load: 64 motors at 1 kHz over UDP on one core, then a day of 4 motors at 100 Hz as fast as it goes.

HOURS and SECONDS make both shorter.
"""

import json
import multiprocessing
import os
import socket
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "python" / "tests" / "live"))

import endless  # noqa: E402
from dqwatch.live.cli import TURN_S  # noqa: E402
from dqwatch.live.core import Live  # noqa: E402
from dqwatch.live.decode import Decoder, format_of  # noqa: E402
from dqwatch.live.motor import Motor, Settings  # noqa: E402
from dqwatch.live.sinks.web import WebSink  # noqa: E402
from dqwatch.live.sources import Source  # noqa: E402
from dqwatch.live.sources.udp import opener  # noqa: E402

MOTORS, RATE_HZ = 64, 1000


def send(address, begin_s, seconds, together):
    """Rows of all motors, as old as their stamp says; so many of them in a datagram."""
    # The receiver has a core of its own, where there are two.
    cores = set(range(os.cpu_count()))
    os.sched_setaffinity(0, cores - {max(cores)} or cores)
    span = next(endless.blocks(0, 10_000, 10_000))
    names = [n for n in span if n != "t_s"]
    tails = [json.dumps(dict(zip(names, r)))[1:] for r in np.column_stack([span[n] for n in names]).tolist()]
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for k in range(seconds * RATE_HZ):
        due_s = begin_s + k / RATE_HZ
        late_s = due_s - time.time()
        if late_s > 0:
            time.sleep(late_s)
        tail = tails[k % len(tails)]
        lines = [f'{{"motor":"m{m}","t_s":{k / RATE_HZ},{tail}' for m in range(MOTORS)]
        for some in range(0, MOTORS, together):
            out.sendto("\n".join(lines[some : some + together]).encode(), address)


def load(seconds, together):
    """CPU of one core, and how old a row is when it is learned."""
    os.sched_setaffinity(0, {os.cpu_count() - 1})
    machine = {**endless.MACHINE, "period_s": 1 / RATE_HZ}
    motors = [Motor(Settings(f"m{m}", machine)) for m in range(MOTORS)]
    decoder = Decoder(format_of("json", 4, {}), "")
    source = Source("udp", "udp", opener("127.0.0.1", 0, decoder), [decoder])
    live = Live(motors, [source], [], None)
    web = WebSink(live.board, "127.0.0.1", 0, "", None)
    live.sinks.append(web)
    live.step(time.time())
    begin_s = time.time() + 1.0
    sender = multiprocessing.get_context("spawn").Process(target=send, args=(source._port.address, begin_s, seconds, together))
    sender.start()
    ages, began, cpu = [], time.time(), None
    ended_s = float("inf")
    while time.time() < ended_s + 1.0:
        if not sender.is_alive():
            ended_s = min(ended_s, time.time())
        turn_s = time.monotonic() + TURN_S
        came = live.step(time.time())
        if cpu is None and time.time() > begin_s:
            cpu, began = time.process_time(), time.time()
        if came:
            ages.append(time.time() - begin_s - motors[0].t_s)
        time.sleep(max(turn_s - time.monotonic(), 0.0))
    used = (time.process_time() - cpu) / seconds
    sender.join()
    rows = sum(m.counts.rows for m in motors)
    lost = MOTORS * RATE_HZ * seconds - rows
    web.close()
    found = f"{MOTORS} motors at {RATE_HZ} Hz over UDP, {together} rows a datagram, {seconds} s, with the page: "
    print(f"{found}{100 * used:.0f} % of one core, {1e6 * used * seconds / max(rows, 1):.1f} µs a row; a row is learned {1e3 * np.median(ages):.0f} ms after it was measured, ", end="")
    print(f"99 % within {1e3 * np.quantile(ages, 0.99):.0f} ms; {lost} of {rows + lost} rows lost, ", end="")
    print(f"{source.health.dropped} datagrams dropped", flush=True)


def day(hours):
    """Memory and events, killed and begun again seven times."""
    began = time.time()
    found = endless.endless(hours, 4, 7)
    peaks = found["peaks_MiB"]
    print(f"{hours:g} h of 4 motors at 100 Hz in {time.time() - began:.0f} s: {found['rows']} rows; ", end="")
    print(f"{found['events_told']} of {found['events_expected']} events told, {found['events_twice']} twice, ", end="")
    print(f"{found['events_other']} others, over {found['restarts']} restarts; ", end="")
    print(f"memory {peaks[0]:.1f} MiB, at the end {peaks[-1]:.1f} MiB", flush=True)
    return found["events_told"] == found["events_expected"] and not found["events_twice"] and not found["events_other"]


if __name__ == "__main__":
    # A datagram holds 64 kB at most.
    for rows_together in (32, 1):
        load(int(os.environ.get("SECONDS", "20")), rows_together)
    sys.exit(0 if day(float(os.environ.get("HOURS", "24"))) else 1)
