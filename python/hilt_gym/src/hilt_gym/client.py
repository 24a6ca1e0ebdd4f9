"""A client of `hilt serve POLICY`."""

from .attached import Attached


class PolicyClient:
    """Asks a policy that is served, by hilt or by anybody who speaks openpi's protocol, for actions.

    ``address`` is that of a server; without one, ``hilt serve POLICY`` is started here with the further ``arguments`` of its command line.
    """

    def __init__(self, policy=None, *, address=None, token=None, binary=None, arguments=()):
        if (address is None) == (policy is None):
            raise ValueError("give the file of a policy, whose server is started here, or the address of a server")
        self._server = Attached("serve", str(policy), *arguments, address=address, token=token, binary=binary)
        self.about = self._server.metadata

    def reset(self, episode=0):
        """Begins an episode: nothing that was seen before counts."""
        self._server.ask({"reset": {"episode": int(episode)}})

    def infer(self, observation):
        """The whole answer to an observation, a dict with LeRobot's keys."""
        return self._server.ask(observation)

    def __call__(self, observation):
        """The first action of the answer."""
        return self.infer(observation)["actions"][0]

    def close(self):
        """Ends the conversation, and the server that was started for it."""
        self._server.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
