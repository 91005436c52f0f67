"""The interpreter stays whole: threads, signals, forks, shutdown, memory; and what a call costs."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import local, long, spd

import nonsmooth as ns

SLACK = float(os.environ.get("NONSMOOTH_SLACK", "1"))


def timed(function, repeats=5):
    """The fastest of several, s."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        function()
        times.append(time.perf_counter() - begun)
    return min(times)


def run(threads):
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_a_call_costs_little():
    problem = ns.LCP(np.eye(2), [-1.0, 1.0])
    many = 2000

    def loop():
        for _ in range(many):
            ns.solve(problem, "lemke")

    inside = min(ns.solve(problem, "lemke").seconds for _ in range(200))
    overhead = timed(loop) / many - inside
    print(f"overhead of a solve: {1e6 * overhead:.1f} µs")
    assert overhead < SLACK * 20e-6


def test_small_solves_do_not_grow():
    resource = pytest.importorskip("resource")

    def rss():
        with open(f"/proc/{os.getpid()}/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    if not os.path.exists("/proc/self/statm"):
        pytest.skip("no /proc")
    problem = ns.LCP(spd(3), [-1.0, 1.0, -1.0])
    q, lemke = np.array([-1.0, 1.0, -1.0]), ns.Lemke()

    def some(k):
        for i in range(k):
            problem.update(q=q)
            answer = ns.solve(problem, lemke if i % 2 else "auto")
            assert answer.z.size == 3
            try:
                ns.LCP(np.eye(2), [1.0])
            except ns.Error:
                pass

    some(5_000)
    gc.collect()
    before = rss()
    some(int(os.environ.get("NONSMOOTH_SOLVES", "100000")))
    gc.collect()
    grown = rss() - before
    print(f"grown by {grown / 1024:.0f} KiB")
    assert grown < 4 << 20


def test_two_threads_solve_at_once():
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one core")
    problems = [local(90, seed, mu=0.8) for seed in range(2)]

    def one(problem):
        for _ in range(4):
            ns.solve(problem, "nsgs", tol=1e-12, max_iter=300)

    def both():
        threads = [threading.Thread(target=one, args=(p,)) for p in problems]
        run(threads)

    best = 0.0
    for _ in range(10):
        alone = timed(lambda: [one(p) for p in problems], 2)
        best = max(best, alone / timed(both, 2))
        if best > 1.6:
            break
    print(f"two threads: {best:.2f} times as fast")
    # Where others use the cores too, it says nothing; that Python goes on meanwhile, another test sees to.
    assert best > 1.6 or SLACK > 1


# The small one takes some 10 ms: a few turns for Python.
@pytest.mark.parametrize("contacts", [80, 400])
def test_python_goes_on_while_a_problem_is_solved(contacts):
    problem = long(contacts)
    thread = threading.Thread(
        target=lambda: ns.solve(problem, "nsgs", tol=1e-300, max_iter=10**9, time_limit=0.5)
    )
    thread.start()
    ticks, longest, last = 0, 0.0, time.perf_counter()
    while thread.is_alive():
        time.sleep(0.001)
        now = time.perf_counter()
        ticks, longest, last = ticks + 1, max(longest, now - last), now
    assert ticks > 4 and longest < SLACK * 0.1


def test_one_problem_in_many_threads():
    problem = local(10)
    expected = ns.solve(problem, "nsgs").r
    wrong = []

    def one():
        for _ in range(50):
            answer = ns.solve(problem, "nsgs")
            if not np.array_equal(answer.r, expected):
                wrong.append(answer)

    threads = [threading.Thread(target=one) for _ in range(6)]
    run(threads)
    assert not wrong


@pytest.mark.parametrize("contacts", [40, 400])
def test_ctrl_c_is_prompt(contacts):
    problem = long(contacts)
    pressed = []

    def press():
        time.sleep(0.3)
        pressed.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt) as caught:
        while True:
            ns.solve(problem, "nsgs", tol=1e-300, max_iter=10**9)
    late = time.perf_counter() - pressed[0]
    thread.join()
    # What was computed is not lost. A small problem may be solved before Ctrl-C is looked for.
    if contacts == 400:
        answer = caught.value.answer
        assert answer.status == ns.Status.CANCELLED and answer.residual < 0.5
        assert problem.judge(answer)["measure"]["relative"] == answer.residual
    print(f"Ctrl-C: {1e3 * late:.0f} ms")
    assert late < SLACK * 0.25
    assert ns.solve(problem, max_iter=10).iterations <= 10


def test_ctrl_c_in_a_function_of_the_users():
    def F(x):
        time.sleep(0.01)
        return x**2 - np.sin(50 * x) - 2

    problem = ns.MCP(F, np.full(3, 10.0))
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(10**6):
            ns.solve(problem, tol=1e-15)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("contacts", [5, 200])
def test_a_forked_process_solves(contacts):
    problem = local(contacts)
    assert ns.solve(problem).solved
    child = os.fork()
    if child == 0:
        os._exit(0 if ns.solve(problem).solved and ns.solve(local(3)).solved else 1)
    begun = time.monotonic()
    while time.monotonic() - begun < 60 * SLACK:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert os.waitstatus_to_exitcode(status) == 0
            return
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    pytest.fail("the forked process hangs")


PROGRAM = """
import threading, numpy as np, nonsmooth as ns
a = np.random.default_rng(0).normal(size=(900, 900))
problem = ns.Friction(W=a @ a.T + np.eye(900), q=-np.ones(900), mu=0.9)
def forever():
    while True:
        ns.solve(problem, "nsgs", tol=1e-300, max_iter=10**9)
def functions():
    while True:
        ns.solve(ns.MCP(lambda x: x**2 - np.sin(50 * x) - 2, np.full(400, 10.0)), tol=1e-15)
for target in (forever, functions):
    threading.Thread(target=target, daemon=True).start()
import time
time.sleep(0.5)
print("end")
"""


def test_the_interpreter_ends_while_threads_solve():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60 * SLACK
    )
    assert done.returncode == 0 and done.stdout == "end\n", done.stderr


def test_objects_go_from_thread_to_thread():
    made = []
    run([threading.Thread(target=lambda: made.append(local(6)))])
    run([threading.Thread(target=lambda: made.append(ns.solve(made[0])))])
    run([threading.Thread(target=lambda: made[0].update(q=-made[0].q))])
    problem, answer = made
    assert answer.solved and answer.r.size == 18 and ns.solve(problem, warm_start=answer).solved


def test_a_problem_may_be_changed_while_others_solve_it():
    problem, wrong = local(10), []
    one, two = problem.q, 2 * problem.q
    expected = ns.solve(problem, tol=1e-12).r

    def change():
        for k in range(200):
            problem.update(q=two if k % 2 else one)

    def solve():
        for _ in range(50):
            # Each solve has the problem that was there when it began: impulses grow as q does.
            r = ns.solve(problem, tol=1e-12).r
            if not any(np.allclose(r, k * expected, atol=1e-8) for k in (1, 2)):
                wrong.append(r)

    run([threading.Thread(target=change), *(threading.Thread(target=solve) for _ in range(3))])
    assert not wrong


def test_what_is_deleted_in_another_thread_is_gone():
    answers = [ns.solve(local(3)) for _ in range(10)]
    thread = threading.Thread(target=answers.clear)
    thread.start()
    thread.join()
    gc.collect()
    assert not answers
