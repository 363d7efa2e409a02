"""`SessionWorker`: the thread in which the requests of one client are answered."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from queue import SimpleQueue
from typing import Any

from pushplan.serving.session import Answer, Session


class SessionWorker:
    """Answers the requests of a client in a thread of its own: policies block, others go on.

    The thread is a daemon: a policy that never returns does not keep the process alive.

    Args:
        session: the client's.
        number: of the client, for the thread's name.
    """

    def __init__(self, session: Session, number: int) -> None:
        self._session, self._loop = session, asyncio.get_running_loop()
        self._requests: SimpleQueue[tuple[bytes, asyncio.Future[Answer]] | None] = SimpleQueue()
        self._ended = asyncio.Event()
        name = f"pushplan client {number}"
        self.thread = threading.Thread(target=self._work, name=name, daemon=True)
        self.thread.start()

    def answer(self, body: bytes) -> asyncio.Future[Answer]:
        """Ask for the reply to a message."""
        future = self._loop.create_future()
        self._requests.put((body, future))
        return future

    async def end(self) -> None:
        """End the planning call that runs, then the thread, and wait for that."""
        self._session.abandon()
        self._requests.put(None)
        await self._ended.wait()
        self.thread.join()

    def _work(self) -> None:
        while (request := self._requests.get()) is not None:
            body, future = request
            self._tell(_resolve, future, self._session.answer(body))
        try:
            self._session.close()
        finally:
            self._tell(self._ended.set)

    def _tell(self, call: Any, *values: Any) -> None:
        with suppress(RuntimeError):  # the loop has been closed without waiting for us
            self._loop.call_soon_threadsafe(call, *values)


def _resolve(future: asyncio.Future[Answer], answer: Answer) -> None:
    if not future.done():
        future.set_result(answer)
