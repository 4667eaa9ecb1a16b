"""Work on the newest item: none is done twice, what came in between is passed over, errors come out."""

from threading import Event

import pytest

from compare.camera.force_estimate import NewestOnly


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


def test_an_error_beside_the_work_is_not_hidden_by_one_in_it():
    def work(item):
        raise ValueError(item)

    def both():
        with NewestOnly(work) as newest:
            newest.put("spoilt")
            raise KeyError

    with pytest.raises(KeyError):
        both()
