"""Where the learner computes, and the random state of that place."""
# pyright: basic

import contextlib
from collections.abc import Iterator

import torch

from shared.errors import ConfigError

_HOST, _CARD = "random_state", "random_state_of_card"


def device_of(name: str) -> torch.device:
    """Return the device of a name.

    Raises:
        ConfigError: it is none, or not here; says which are.
    """
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:  # torch without CUDA asserts
        cards = [f"cuda:{index}" for index in range(torch.cuda.device_count())]
        raise ConfigError(
            f"learner.device is {name!r}, which this torch ({torch.__version__}) cannot use: "
            f"{str(error).splitlines()[0]}; here are {', '.join(('cpu', *cards))}"
        ) from None
    return device


class RandomState:
    """What torch's generators of one learner have come to, apart from everybody else's."""

    def __init__(self, device: torch.device) -> None:
        """Begin with torch's own.

        Args:
            device: on which minibatches are drawn; a card has a generator of its own.
        """
        self._cards = [device] if device.type == "cuda" else []
        self.host = torch.get_rng_state()
        self._card: torch.Tensor | None = None
        self.keep()

    @contextlib.contextmanager
    def forked(self) -> Iterator[None]:
        """Leave torch's generators as they were when the block ends."""
        with torch.random.fork_rng(devices=self._cards):
            yield

    def keep(self) -> None:
        """Remember what the generators have come to."""
        self.host = torch.get_rng_state()
        for card in self._cards:
            self._card = torch.cuda.get_rng_state(card)

    def put_back(self) -> None:
        """Go on from what was kept."""
        torch.set_rng_state(self.host)
        if self._card is not None:
            torch.cuda.set_rng_state(self._card, self._cards[0])

    def state(self) -> dict[str, torch.Tensor]:
        """Return it as tensors, by name."""
        state = {_HOST: self.host.clone()}
        return state if self._card is None else state | {_CARD: self._card.clone()}

    def restore(self, state: dict[str, torch.Tensor]) -> None:
        """Continue from what ``state`` returned.

        Where it comes from a processor, a card's generator stays as it was seeded.

        Raises:
            KeyError: there is none in it.
        """
        self.host = state[_HOST].clone()
        if self._cards and _CARD in state:
            self._card = state[_CARD].clone()
