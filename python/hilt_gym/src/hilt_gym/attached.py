"""A server to talk to: one that runs, or one that is started for it."""

from .process import HiltProcess
from .wire import Conversation


class Attached:
    """A conversation with the server at ``address``; without one, ``hilt ARGUMENTS`` is started here, and ended by ``close()``."""

    def __init__(self, *arguments, address=None, token=None, binary=None):
        self._wire, self._server = None, None if address is not None else HiltProcess(*arguments, binary=binary)
        self.address = address if self._server is None else self._server.address
        try:
            self._wire = Conversation(self.address, token)
        except BaseException:
            self.close()
            raise
        self.metadata = self._wire.metadata

    def ask(self, message):
        """The answer to a message."""
        return self._wire.ask(message)

    def close(self):
        """Ends the conversation, and the server that was started for it."""
        if self._wire is not None:
            self._wire.close()
            self._wire = None
        if self._server is not None:
            self._server.close()
            self._server = None
