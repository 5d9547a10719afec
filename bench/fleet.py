"""The fleet as a whole: who is found on seeds never used, what an engine costs beside the bare fit, how large a page is.

Ratios are of processor time, all processes of a run together, so that they hold on a machine that does something else.
"""
import argparse
import base64
import csv
import hashlib
import http.server
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import dqwatch
import dqwatch.fleet
import pyarrow as pa
import pyarrow.parquet as pq
from dqwatch.fleet.compare import compare
from dqwatch.fleet.page import page
from dqwatch.fleet.simulated.planted import drawn
from dqwatch.fleet.simulated.short import windows
from dqwatch.fleet.simulated.write import write
from dqwatch.fleet.sources import sources
from dqwatch.fleet.windows import windows_of
from dqwatch.fleet.work import Settings, channels

CLICK = """
const rows = [...document.querySelectorAll("#standing button.row")], times = [];
for (const row of rows.slice(0, 10)) {
  const begin = performance.now(); row.click(); document.getElementById("one").getBoundingClientRect(); times.push(performance.now() - begin);
  document.querySelector("#one button").click();
}
const root = document.documentElement.dataset;
return { first: Number(root.first), ready: Number(root.ready), click: Math.max(...times), motors: rows.length };
"""


def score(folder, seeds, motors, keep):
    """Draws, writes, fits and compares fleets; prints what was found of what was planted."""
    found = planted_in_all = false = 0
    for seed in seeds:
        root = folder / str(seed)
        fleet = drawn(seed, motors, each=None if motors >= 200 else 1, batch=10 if motors >= 200 else 5)
        begin = time.time()
        logs = write(fleet, root)
        made_s = time.time() - begin
        begin, begin_cpu_s = time.time(), time.process_time()
        result = dqwatch.fleet(logs, root / "out")
        fitted_s, cpu_s = time.time() - begin, time.process_time() - begin_cpu_s
        rows = sum(result.windows["rows"].to_pylist())
        said = {s.motor: s.cause for s in result.comparison.standing}
        with open(root / "planted.csv", newline="") as file:
            planted = {r["motor"]: r["planted"] for r in csv.DictReader(file)}
        right = [m for m, what in planted.items() if said.get(m) == what]
        wrong = sorted(set(said) - set(planted))
        found, planted_in_all, false = found + len(right), planted_in_all + len(planted), false + len(wrong)
        print(f"seed {seed}: {len(right)} of {len(planted)} planted found and rightly named, {len(wrong)} false; "
              f"made in {made_s:.0f} s, fitted and compared in {fitted_s:.0f} s; {rows:.1e} rows, "
              f"{rows / cpu_s:.0f} a processor second; page {result.page.stat().st_size / 1e6:.2f} MB", flush=True)
        for m in sorted(set(planted) - set(right)):
            print(f"  {m}: {planted[m]}, said: {said.get(m) or 'nothing'}")
        for m in wrong:
            signs = next(s.signs for s in result.comparison.standing if s.motor == m)
            print(f"  {m}: nothing planted, said: {said[m]} ({signs[0].parameter} {signs[0].what} {signs[0].z:.1f})")
        together = {(c.key, c.label) for c in result.comparison.common}
        if together != {("site", fleet.sagging_site)}:
            print(f"  changed together: {sorted(together)}, true: site {fleet.sagging_site}")
        if keep:
            for name in ("out/fleet.html", "out/standing.csv", "planted.csv"):
                shutil.copy(root / name, pathlib.Path(keep) / f"{seed}-{pathlib.Path(name).name}")
        shutil.rmtree(root)
    print(f"in all {found} of {planted_in_all} ({100 * found / planted_in_all:.1f} %), {false} false "
          f"in {len(seeds)} fleets of {motors}")


def tree_cpu_s(pid):
    """Processor seconds of a process and all below it, those that ended included where their parent waited."""
    ticks = os.sysconf("SC_CLK_TCK")
    below, cpu = {}, {}
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            text = (entry / "stat").read_text()
        except OSError:
            continue
        values = text[text.rindex(")") + 2:].split()
        below.setdefault(int(values[1]), []).append(int(entry.name))
        cpu[int(entry.name)] = sum(map(int, values[11:15])) / ticks
    total, waiting = 0.0, [pid]
    while waiting:
        one = waiting.pop()
        total += cpu.get(one, 0.0)
        waiting += below.get(one, [])
    return total


def many(folder, logs, windows_wanted):
    """A folder of so many windows: the logs that are there, linked again and again under other motors."""
    files = sorted(logs.glob("motor=*/????-??-??.parquet"))
    target = folder / f"linked{windows_wanted}"
    for k in range(windows_wanted):
        place = target / f"motor=L{k // 8:06d}"
        place.mkdir(parents=True, exist_ok=True)
        os.link(files[k % len(files)], place / f"2026-01-{1 + k % 8:02d}.parquet")
    papers = ["motor,type,pole_pairs"] + [f"L{k:06d},J24,4" for k in range(windows_wanted // 8 + 1)]
    (target / "motors.csv").write_text("\n".join(papers) + "\n")
    return target


def bare(logs):
    """Rows a processor second of the fit alone, tables in memory."""
    tables = [channels(pq.ParquetFile(s.path).read()) for s in sources(logs)]
    before = time.process_time()
    for t in tables:
        dqwatch.fit(t, pole_pairs=4, machine={"log": {"regime": "polled"}}, progress=False)
    return sum(t.num_rows for t in tables) / (time.process_time() - before)


def cost(folder, count):
    fleet = drawn(1, 8, each=0, batch=2)
    logs = many(folder, write_polled(fleet, folder / "cost"), count)
    ours = bare(logs)
    rows = 3000 * count
    run = [sys.executable, __file__, "one-core", str(logs), str(folder / "cost-out")]
    affinity = next(iter(os.sched_getaffinity(0)))
    done = json.loads(subprocess.run(run, capture_output=True, text=True, check=True,
                                     preexec_fn=lambda: os.sched_setaffinity(0, {affinity})).stdout.splitlines()[-1])
    print(f"{rows} rows on one core: the fit alone {ours:.0f} rows/s, with DuckDB {rows / done['run_s']:.0f}: "
          f"{100 * rows / done['run_s'] / ours:.0f} %")
    spark = os.environ.get("SPARK_PYTHON")
    if not spark or not shutil.which("java"):
        print("skipped: Spark (no java, or no SPARK_PYTHON with pyspark)")
        return
    run = [spark, __file__, "spark", str(logs), str(folder / "spark-out")]
    out = subprocess.run(run, capture_output=True, text=True)
    if out.returncode:
        print(f"skipped: Spark ({out.stderr.splitlines()[-1:]})")
        return
    done = json.loads(out.stdout.splitlines()[-1])
    print(f"with Spark, local[1], beyond its start of {done['start_s']:.0f} s of processor: "
          f"{rows / done['run_s']:.0f} rows/s: {100 * rows / done['run_s'] / ours:.0f} %; the same rows to the bit: "
          f"{same(folder / 'cost-out', folder / 'spark-out')}")
    print(f"  applyInArrow by file with nothing in it: {rows / done['grouped_s']:.0f} rows/s; with the fit in it it could "
          f"have {100 / (1 + ours * done['grouped_s'] / rows):.0f} %")


def same(a, b):
    from dqwatch.fleet.store import Store

    return Store(a).table().equals(Store(b).table())


def write_polled(fleet, root):
    """Without the coasting logs: the cost is of polled rows."""
    from dqwatch.fleet.simulated import write as module

    kept, module.coasting = module.coasting, lambda fleet: []
    try:
        return write(fleet, root)
    finally:
        module.coasting = kept


def one_core(logs, out):
    from dqwatch.fleet.run import run
    from dqwatch.fleet.sources import papers_of
    from dqwatch.fleet.store import Store

    store, found, papers = Store(out), sources(logs), papers_of(logs, None)
    before = time.process_time()
    run(store, found, Settings(), papers, "1GB", 1)
    print(json.dumps({"run_s": time.process_time() - before}))


def on_spark(logs, out):
    from dqwatch.fleet import spark
    from dqwatch.fleet.sources import papers_of
    from dqwatch.fleet.store import Store
    from pyspark.sql import SparkSession

    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    session = (SparkSession.builder.master("local[1]").config("spark.ui.enabled", "false")
               .config("spark.sql.shuffle.partitions", "4").getOrCreate())
    found, papers = sources(logs), papers_of(logs, None)
    # Its start: the session, workers, and what its compiler makes of a first job.
    with tempfile.TemporaryDirectory() as first:
        spark.run(Store(first), found[:8], Settings(), papers, "1GB")
    start_s = tree_cpu_s(os.getpid())
    spark.run(Store(out), found, Settings(), papers, "1GB")
    run_s = tree_cpu_s(os.getpid()) - start_s
    # Beside it the rows through Spark itself, a group a file, and nothing done with them.
    grouped(session, found[:8])
    begin_s = tree_cpu_s(os.getpid())
    grouped(session, found)
    print(json.dumps({"start_s": start_s, "run_s": run_s, "grouped_s": tree_cpu_s(os.getpid()) - begin_s}))
    session.stop()


def grouped(session, found):
    from pyspark.sql.functions import input_file_name

    frame = session.read.parquet(*(str(pathlib.Path(s.path).resolve()) for s in found))
    counted = frame.withColumn("file", input_file_name()).groupBy("file").applyInArrow(
        lambda rows: pa.table({"rows": [rows.num_rows]}), "rows long").toArrow()
    assert counted.num_rows == len(found) and sum(counted["rows"].to_pylist()) == 3000 * len(found)


def in_one_file(folder, logs, windows_wanted):
    """As many(), in one file, rows in the order of time: every motor's a row, then every motor's next."""
    tables = [channels(pq.ParquetFile(f).read()) for f in sorted(logs.glob("motor=*/????-??-??.parquet"))]
    target = folder / f"one{windows_wanted}"
    target.mkdir()
    (target / "motors.csv").write_text("\n".join(["motor,type,pole_pairs", *(
        f"L{k:06d},J24,4" for k in range(windows_wanted))]) + "\n")
    names = pa.array([f"L{k:06d}" for k in range(windows_wanted)])
    of = [tables[k % len(tables)] for k in range(windows_wanted)]
    with pq.ParquetWriter(target / "2026-01-05.parquet", of[0].schema.append(pa.field("motor", pa.string()))) as file:
        for row in range(0, of[0].num_rows, 50):
            piece = pa.concat_tables([t.slice(row, 50) for t in of])
            order = pa.array([50 * k + j for j in range(50) for k in range(windows_wanted)])
            piece = piece.take(order).append_column("motor", pa.concat_arrays([names] * 50))
            file.write_table(piece, row_group_size=100_000)
    return target


def scale(folder, counts, memory, unfitted):
    """`unfitted` windows: all of a run but its fits, which are done once for each of the few different logs."""
    fleet = drawn(1, 8, each=0, batch=2)
    small = write_polled(fleet, folder / "scale")
    one = max(counts)
    for count, what, logs in [
        *((n, "memory", many) for n in counts), (unfitted, "unfitted", many), (one, "unfitted", in_one_file)
    ]:
        logs = logs(folder, small, count)
        run = [sys.executable, __file__, what, str(logs), str(folder / f"{logs.name}-{what}"), "--memory", memory]
        begin = time.time()
        done = json.loads(subprocess.run(run, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
        print(f"{3000 * count:.0e} rows in {'one file' if logs.name.startswith('one') else f'{count} files'}"
              f"{', all but the fits' if what == 'unfitted' else ''}: {time.time() - begin:.0f} s, "
              f"{3000 * count / done['cpu_s']:.0f} rows a processor second, "
              f"{done['MB']:.0f} MB at most, of --memory {memory}", flush=True)
        shutil.rmtree(logs)


def memory_of(logs, out, memory, fits=True):
    from dqwatch.fleet import run as runs

    fit, known = runs.window_row, {}

    def once(log, settings, papers, machine="", **where):
        key = (log["v_q_V"][0].as_py(), log["i_q_A"][0].as_py(), log["v_q_V"][-1].as_py())
        if key not in known:
            known[key] = fit(log, settings, papers, machine, **where)
        return known[key] | where

    if not fits:
        runs.window_row = once
    dqwatch.fleet(logs, out, memory=memory)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps({"MB": usage.ru_maxrss / 1024, "cpu_s": usage.ru_utime + usage.ru_stime}))


def in_chromium(text, folder, script):
    """What `script` gives once the page is ready, in true time; None where it never is."""
    found = []

    class Listener(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            found.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Listener) as server:
        server.timeout = 60
        where = f"http://127.0.0.1:{server.server_port}"
        probe = ("(async () => { while (!document.documentElement.dataset.ready) await new Promise((go) => setTimeout(go, 20));"
                 f"const said = (() => {{ {script} }})(); fetch('{where}', {{ method: 'POST', mode: 'no-cors', body: JSON.stringify(said) }}); }})();")
        digest = base64.b64encode(hashlib.sha256(probe.encode()).digest()).decode()
        # The page's own policy stands, but for this script and where it answers.
        text = text.replace("script-src '", f"connect-src {where}; script-src 'sha256-{digest}' '", 1)
        path = (folder / "timed.html").resolve()
        path.write_text(text.replace("</body>", f"<script>{probe}</script></body>"), encoding="utf-8")
        chromium = subprocess.Popen(
            ["chromium", "--headless=new", "--no-sandbox", "--no-first-run", "--disable-gpu", "--disable-dev-shm-usage",
             "--disable-extensions", f"--user-data-dir={path.parent / 'profile'}", f"file://{path}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        server.handle_request()
        chromium.terminate()
        chromium.wait()
    return found[0] if found else None


def browser(folder, motors):
    if not shutil.which("chromium"):
        print("skipped: the page in Chromium (no chromium here; make tools installs it)")
        return
    table = windows(drawn(1, motors))
    begin = time.time()
    w = windows_of(table)
    c = compare(w)
    compared_s = time.time() - begin
    text = page(w, c, table)
    print(f"{motors} motors, {table.num_rows} windows: compared in {compared_s:.0f} s; page {len(text) / 1e6:.1f} MB "
          "(wanted 20)")
    if seen := in_chromium(text, folder, CLICK):
        print(f"  in Chromium: first view {seen['first'] / 1e3:.2f} s (wanted 2), all {seen['ready'] / 1e3:.2f} s, "
              f"slowest of ten clicks {seen['click'] / 1e3:.3f} s (wanted 0.2)")


def compared(seeds, motors):
    """Fleets whose windows are drawn with the scatter of fits, without logs: seconds a fleet."""
    found = planted_in_all = false = 0
    for seed in seeds:
        fleet = drawn(seed, motors, each=None, batch=10)
        said = {s.motor: s.cause for s in compare(windows_of(windows(fleet))).standing}
        planted = {m.name: m.planted for m in fleet.members if m.planted}
        right = sum(said.get(m) == what for m, what in planted.items())
        wrong = {m: said[m] for m in set(said) - set(planted)}
        print(f"seed {seed}: {right} of {len(planted)} planted found and rightly named, {len(wrong)} false {wrong or ''}")
        found, planted_in_all, false = found + right, planted_in_all + len(planted), false + len(wrong)
    print(f"in all {found} of {planted_in_all}, {false} false in {len(seeds)} fleets of {motors}")


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("what", choices=["all", "compared", "score", "cost", "scale", "page", "one-core", "spark", "memory",
                                    "unfitted"])
    p.add_argument("paths", nargs="*")
    p.add_argument("--seeds", default="1001")
    p.add_argument("--motors", type=int, default=1000)
    p.add_argument("--keep", metavar="DIR", help="takes the page, who stands out, and the truth of each fleet")
    p.add_argument("--windows", default="34,334,3334", help="of the runs that show how time grows")
    p.add_argument("--unfitted", type=int, default=33334, help="windows of the run without fits")
    p.add_argument("--memory", default="512MiB")
    p.add_argument("--count", type=int, default=200, help="windows of the cost")
    a = p.parse_args()
    if a.what == "compared":
        return compared([int(x) for x in a.seeds.split(",")], a.motors)
    if a.what == "one-core":
        return one_core(*a.paths)
    if a.what == "spark":
        return on_spark(*a.paths)
    if a.what in ("memory", "unfitted"):
        return memory_of(*a.paths, a.memory, fits=a.what == "memory")
    with tempfile.TemporaryDirectory(dir=os.environ.get("BUILD")) as name:
        folder = pathlib.Path(name)
        if a.what in ("all", "score"):
            score(folder, [int(s) for s in a.seeds.split(",")], a.motors, a.keep)
        if a.what in ("all", "cost"):
            cost(folder, a.count)
        if a.what in ("all", "scale"):
            scale(folder, [int(n) for n in a.windows.split(",")], a.memory, a.unfitted)
        if a.what in ("all", "page"):
            browser(folder, 10000)
    return None


if __name__ == "__main__":
    main()
