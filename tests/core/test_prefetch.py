import threading
import time

import pytest
import torch

from avn.core.prefetch import PrefetchLoader, prefetch, threads_for_one_operation


@pytest.mark.parametrize("threads", [1, 3])
def test_results_come_in_order(threads: int) -> None:
    def make(part: int) -> int:
        time.sleep(0.002 * (part % 3))  # later ones are ready first
        return part * part

    assert list(prefetch(make, range(20), threads)) == [part * part for part in range(20)]


def test_work_runs_ahead_in_threads_but_not_far() -> None:
    started: list[int] = []
    names = set()

    def make(part: int) -> int:
        started.append(part)
        names.add(threading.current_thread())
        return part

    results = prefetch(make, range(100), 2)
    assert next(results) == 0
    deadline = time.monotonic() + 5
    while len(started) < 3 and time.monotonic() < deadline:
        time.sleep(0.001)
    assert 3 <= len(started) <= 5
    assert threading.current_thread() not in names
    results.close()
    assert len(started) <= 5


def test_an_error_reaches_who_asks() -> None:
    def make(part: int) -> float:
        return 1 / (2 - part)

    results = prefetch(make, range(5), 2)
    assert [next(results), next(results)] == [0.5, 1.0]
    with pytest.raises(ZeroDivisionError):
        next(results)


class _Squares(torch.utils.data.Dataset):
    def __len__(self) -> int:
        return 10

    def __getitems__(self, items: list[int]) -> torch.Tensor:
        return torch.tensor(items) ** 2


def test_loader_gives_the_dataset_s_batches() -> None:
    loader = PrefetchLoader(_Squares(), 2, batch_size=4, sampler=[9, 0, 3, 2, 5])
    assert len(loader) == 2
    for _ in range(2):
        assert [batch.tolist() for batch in loader] == [[81, 0, 9, 4], [25]]


def test_thread_count_is_restored() -> None:
    before = torch.get_num_threads()
    with threads_for_one_operation(before + 1):
        assert torch.get_num_threads() == before + 1
    assert torch.get_num_threads() == before
