"""Work on the newest item: none is done twice, what came in between is passed over, errors come out."""

import gc
from concurrent.futures import Future
from threading import Event
from time import sleep

import pytest

from pinnray.film.force_estimate import NewestOnly


def test_the_newest_item_is_taken_and_those_before_it_are_passed_over():
    done, started, go_on = [], Event(), Event()

    def work(item):
        done.append(item)
        started.set()
        assert go_on.wait(10)

    with NewestOnly(work) as newest:
        newest.put(1)
        assert started.wait(10)
        for item in (2, 3, 4):
            newest.put(item)
        go_on.set()
    assert done == [1, 4]
    assert newest.passed_over == 2


def test_the_last_item_is_done_before_the_end_and_without_items_there_is_none():
    done = []
    with NewestOnly(done.append) as newest:
        newest.put("last")
        newest.finish()
        assert done == ["last"]
    with NewestOnly(done.append):
        pass
    assert done == ["last"]


def test_an_error_in_the_work_is_raised_at_the_end():
    def work(item):
        raise ValueError(item)

    with pytest.raises(ValueError, match="spoilt"), NewestOnly(work) as newest:
        newest.put("spoilt")


def test_an_error_in_the_work_is_raised_with_the_next_item_and_no_more_is_done():
    done, failing, go_on = [], Event(), Event()

    def work(item):
        done.append(item)
        failing.set()
        assert go_on.wait(10)
        raise ValueError(item)

    def all_items():
        with NewestOnly(work) as newest:
            newest.put("spoilt")
            assert failing.wait(10)
            newest.put("waiting")
            go_on.set()
            for _ in range(1000):  # of which the first ones may still replace the one that waits
                sleep(0.01)
                newest.put("next")

    with pytest.raises(ValueError, match="spoilt"):
        all_items()
    assert done == ["spoilt"]


def test_work_that_is_done_is_not_kept():
    done = []
    with NewestOnly(done.append) as newest:
        for number in range(100):
            newest.put(number)
            while len(done) <= number:
                pass
        assert sum(issubclass(type(each), Future) for each in gc.get_objects()) < 10
    assert done == list(range(100))


def test_an_error_beside_the_work_is_not_hidden_by_one_in_it():
    def work(item):
        raise ValueError(item)

    def both():
        with NewestOnly(work) as newest:
            newest.put("spoilt")
            raise KeyError

    with pytest.raises(KeyError):
        both()
