"""Judges what wasp-camera measured on vivid in the guest: vivid_verdict.py CONSOLE. Exit code 1 for any miss."""
import json
import sys


def read(path):
    figures = {}
    with open(path, errors="replace") as console:
        for line in console:
            words = line.strip().split(" ", 2)
            if len(words) == 3 and words[0] == "@wasp":
                try:
                    figures[words[1]] = json.loads(words[2])
                except json.JSONDecodeError:
                    print("unreadable:", line.strip())
    return figures


def main(path):
    figures = read(path)
    misses = 0

    def check(name, value, ok):
        nonlocal misses
        misses += not ok
        print(f"{'ok' if ok else 'MISS':<4} {name:<60} {value}")

    cameras = [c for c in figures.get("list", []) if c["driver"] == "v4l2"]
    grey = [f for c in cameras for f in c["formats"] if f.startswith("GREY 640x480")]
    check("list: one camera, grey offered", grey, len(cameras) == 1 and len(grey) == 1)
    for name, rate in (("grey", 60), ("yuyv", 25)):
        run = figures.get(name, [{}])[0]
        frames, period_ms = run.get("frames", 0), run.get("interval_p50_ns", 0) * 1e-6
        check(f"{name}: SCHED_FIFO, locked memory", run.get("real_time"), run.get("real_time") is True)
        check(f"{name}: frames in 5 s at {rate} Hz", frames, abs(frames - 5 * rate) <= 5)
        check(f"{name}: damaged, late", [run.get(k) for k in ("corrupt", "timeouts")],
              all(run.get(k) == 0 for k in ("corrupt", "timeouts")))
        # vivid counts frames by ticks of 4 ms: at 60 Hz it passes over a number now and then, with no frame behind it
        check(f"{name}: dropped", run.get("dropped"), 0 <= run.get("dropped", -1) <= (2 if name == "grey" else 0))
        # vivid says when a frame will have ended, 0.9 periods after it hands it out; only its first is not ahead of us
        wrong = range(frames - 1, frames + 1) if name == "grey" else (0,)
        check(f"{name}: time stamps not believed", run.get("estimated"), run.get("estimated") in wrong)
        check(f"{name}: period by its time stamps [ms]", f"{period_ms:.2f}", abs(period_ms - 1000 / rate) < 0.04 * 1000 / rate)
        # the first frame waits in the queue until the second is there
        latency_ms = [run.get(f"latency_{k}_ns", 1e9) * 1e-6 for k in ("p50", "p99", "max")]
        check(f"{name}: stamp to publication p50 / p99 / max [ms]", " / ".join(f"{t:.3f}" for t in latency_ms),
              0 < latency_ms[0] and latency_ms[1] < 5 and latency_ms[2] < 1000 / rate + 5)
    run = figures.get("drops", [{}])[0]
    total = run.get("frames", 0) + run.get("dropped", 0)
    check("drops: seen in the sequence", run.get("dropped"), run.get("dropped", 0) >= 5)
    check("drops: published and dropped make the whole", total, abs(total - 150) <= 5)
    run = figures.get("errors", [{}])[0]
    check("errors: damaged frames counted", run.get("corrupt"), 1 <= run.get("corrupt", 0) <= 10)
    check("errors: a broken queue is opened anew", run.get("reopened"), run.get("reopened") == 1)
    run = figures.get("unplug", [{}])[0]
    check("unplug: lost and found again", run.get("reopened"), run.get("reopened") == 1)
    check("unplug: frames before and after", run.get("frames"), run.get("frames", 0) >= 100)
    check("the guest came to its end", "end" in figures, "end" in figures)
    if misses:
        with open(path, errors="replace") as console:
            print("".join(line for line in console if line.startswith("@log") or "error" in line.lower()))
    return 1 if misses else 0


sys.exit(main(sys.argv[1]))
