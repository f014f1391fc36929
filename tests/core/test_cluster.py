"""Workers that are processes: the same answers as threads, whatever happens to the processes."""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import time
from importlib.metadata import version
from operator import add, call

import numpy as np
import pytest
from distributed import Client
from distributed.utils import LoopRunner
from threadpoolctl import threadpool_info

from sparsor.core.cluster import Cluster
from sparsor.core.schedulers import workers_at
from sparsor.errors import SchedulerError, WorkersLostError


@pytest.fixture(scope="module")
def two():
    with workers_at("local", 2) as hands:
        yield hands


def test_without_a_scheduler_the_workers_are_threads():
    with workers_at(None, 3) as hands:
        assert not isinstance(hands, Cluster)
        assert hands.count == 3


def test_results_come_in_the_order_of_the_parts(two):
    assert isinstance(two, Cluster)
    assert two.count == 2
    assert list(two.map(add, two.share(100), range(20))) == list(range(100, 120))
    assert two.call(add, two.share("a"), "b") == "ab"


def test_parts_are_taken_when_there_is_room_for_them(two):
    taken = []
    results = two.map(add, two.share(0), (taken.append(part) or part for part in range(1000)))
    assert next(results) == 0
    assert len(taken) < 20
    results.close()
    assert list(two.map(add, two.share(1), [1])) == [2]  # what was left behind is out of the way


def test_arrays_can_be_written_to_on_both_sides(two):
    # To numba an array that cannot be written to is another type, which would be compiled for anew.
    made = two.call(np.ndarray.astype, two.share(np.zeros(100_000)), np.float64)
    assert made.flags.writeable
    assert two.call(np.ndarray.__iadd__, two.share(np.zeros(100_000)), np.ones(100_000)).sum() == 100_000


def test_errors_of_the_work_are_its_own(two):
    with pytest.raises(TypeError):
        list(two.map(add, two.share(1), [1, "one"]))
    assert two.call(add, two.share(1), 1) == 2


def test_a_worker_that_is_killed_costs_time_and_nothing_else(two):
    def slowly(part):
        time.sleep(0.05)
        return part

    processes = set(two.processes())
    left, results = sorted(processes), []
    for result in two.map(call, two.share(slowly), range(24)):
        results.append(result)
        if left and len(results) % 6 == 0:  # one after the other: in the end nobody is left who was there
            os.kill(left.pop(), signal.SIGKILL)
    assert results == list(range(24))
    two._client.wait_for_workers(2)
    assert not set(two.processes()) & processes


def test_a_part_that_kills_its_workers_is_given_up():
    with workers_at("local", 1) as hands, pytest.raises(WorkersLostError, match="same part of the work"):
        hands.call(call, hands.share(signal.raise_signal), signal.SIGKILL)


def test_workers_compute_with_one_thread_for_linear_algebra(two):
    shared = two.share(lambda _part: [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"])
    assert set(two.call(call, shared, None)) <= {1}


@pytest.fixture(scope="module")
def scheduler():
    """A scheduler of somebody's own, without workers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    words = ("-m", "distributed.cli.dask_scheduler", "--host", address, "--no-dashboard")
    with subprocess.Popen([sys.executable, *words], stderr=subprocess.DEVNULL) as process:
        yield address
        process.terminate()


def test_a_scheduler_elsewhere_is_used_with_the_workers_it_has(scheduler, monkeypatch):
    for _ in range(100):
        try:
            with (
                pytest.raises(SchedulerError, match="has no workers: start some with 'dask worker"),
                workers_at(scheduler),
            ):
                pass
        except AssertionError:  # it has not started yet
            time.sleep(0.1)
        else:
            break
    words = ("-m", "distributed.cli.dask_worker", scheduler, "--no-nanny", "--nthreads", "2", "--no-dashboard")
    monkeypatch.setattr("sparsor.core.cluster._PATIENCE_S", 1)
    with (
        subprocess.Popen([sys.executable, *words], stderr=subprocess.DEVNULL) as worker,
        workers_at(scheduler) as hands,
    ):
        assert hands.count == 2
        shared = hands.share(1)
        assert list(hands.map(add, shared, range(9))) == list(range(1, 10))
        worker.kill()  # and nobody starts another one
        with pytest.raises(WorkersLostError, match="has had no worker for 1 s"):
            list(hands.map(add, shared, range(9)))
        with pytest.raises(WorkersLostError, match="no worker"):
            hands.call(add, shared, 1)
        with pytest.raises(WorkersLostError, match="no worker"):
            hands.share(2)


def test_nobody_at_an_address_is_said_with_the_address():
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "nobody", ""):
        with pytest.raises(SchedulerError, match=f"no dask scheduler answers at '{address}'"), workers_at(address):
            pass


def test_nothing_is_left_of_a_client_that_reached_nobody_when_the_next_one_starts(two, monkeypatch):
    """It would close itself when it is collected, and wait for a lock of dask's that the start holds."""
    start, there = LoopRunner._start_unlocked, []

    def clients():
        return sum(isinstance(one, Client) for one in gc.get_objects())

    def look(runner):
        there.append(clients())
        start(runner)

    gc.collect()
    before = clients()  # that of the fixture among them
    gc.disable()
    try:
        with pytest.raises(SchedulerError), workers_at("tcp://127.0.0.1:9"):
            pass
        monkeypatch.setattr(LoopRunner, "_start_unlocked", look)
        with workers_at(two._client.scheduler.address):
            pass
    finally:
        gc.enable()
    assert there == [before + 1]


def test_a_number_of_workers_is_for_those_of_our_own():
    with pytest.raises(SchedulerError, match="leave --workers out"), workers_at("tcp://127.0.0.1:9", 2):
        pass


def test_other_versions_are_refused(two, monkeypatch):
    monkeypatch.setattr("sparsor.core.schedulers._here", lambda name: "0.0.1" if name == "Python" else version(name))
    with (
        pytest.raises(SchedulerError, match=r"runs Python .*, here it is 0\.0\.1"),
        workers_at(two._client.scheduler.address),
    ):
        pass
