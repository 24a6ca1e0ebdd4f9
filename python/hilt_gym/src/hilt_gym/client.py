"""A client of `hilt serve POLICY`."""

from .process import HiltProcess
from .wire import Conversation


class PolicyClient:
    """Asks a policy that is served, by hilt or by anybody who speaks openpi's protocol, for actions.

    ``address`` is that of a server; without one, ``hilt serve POLICY`` is started here with the further ``arguments`` of its command line.
    """

    def __init__(self, policy=None, *, address=None, token=None, binary=None, arguments=()):
        self._server, self._wire = None, None
        if (address is None) == (policy is None):
            raise ValueError("give the file of a policy, whose server is started here, or the address of a server")
        if address is None:
            self._server = HiltProcess("serve", str(policy), *arguments, binary=binary)
            address = self._server.address
        try:
            self._wire = Conversation(address, token)
        except BaseException:
            self.close()
            raise
        self.about = self._wire.metadata

    def reset(self, episode=0):
        """Begins an episode: nothing that was seen before counts."""
        self._wire.ask({"reset": {"episode": int(episode)}})

    def infer(self, observation):
        """The whole answer to an observation, a dict with LeRobot's keys."""
        return self._wire.ask(observation)

    def __call__(self, observation):
        """The first action of the answer."""
        return self.infer(observation)["actions"][0]

    def close(self):
        """Ends the conversation, and the server that was started for it."""
        if self._wire is not None:
            self._wire.close()
            self._wire = None
        if self._server is not None:
            self._server.close()
            self._server = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
