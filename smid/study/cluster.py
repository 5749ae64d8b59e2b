"""A Dask cluster as an executor."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from smid.study.errors import StudyError

_PATIENCE = 10.0  # seconds


@contextmanager
def dask_executor(address: str, timeout: float = _PATIENCE) -> Iterator[Executor]:
    """Connect to the scheduler of a Dask cluster; yield an executor that runs on its workers.

    Parameters
    ----------
    address
        As the scheduler prints it, such as ``tcp://10.0.0.1:8786``.
    timeout
        Seconds to wait for the scheduler, and for a first worker.

    Raises
    ------
    StudyError
        If Dask is not installed, no scheduler answers, or there are no workers.

    Examples
    --------
    >>> try:
    ...     with dask_executor("10.0.0.1") as executor:  # a port is missing
    ...         pass  # order_study(model, records, bounds, executor=executor)
    ... except StudyError as error:
    ...     print(str(error).partition(":")[0])
    no Dask scheduler answers at 10.0.0.1 within 10 s
    """
    try:
        from distributed import Client
    except ImportError:
        raise StudyError("a Dask cluster needs dask: install it with pip install 'smid[dask]'") from None
    try:
        client = Client(address, timeout=timeout)  # type: ignore[no-untyped-call]
    except (OSError, TimeoutError, ValueError):
        raise StudyError(
            f"no Dask scheduler answers at {address} within {timeout:g} s: start one with 'dask scheduler', take the "
            "address that it prints, and look whether a firewall lies between; or leave out Dask"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=timeout)
        except TimeoutError:
            raise StudyError(
                f"the Dask scheduler at {address} has no workers: start some with 'dask worker {address}'"
            ) from None
        yield client.get_executor(pure=False)  # type: ignore[no-untyped-call]
