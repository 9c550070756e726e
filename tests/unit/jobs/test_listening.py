"""Where the router of a run listens."""

from services.jobs.train.processes import endpoint_of, listen_words
from shared.bus.config import BusConfig
from shared.bus.ports import free_port


def test_a_router_listens_at_every_endpoint_of_the_site_file():
    first, second = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    cfg = BusConfig(listen=(first, second))
    assert endpoint_of(cfg) == first
    assert listen_words(cfg, first) == ("--listen", first, "--listen", second)


def test_a_run_without_an_endpoint_of_its_own_takes_one_that_is_free():
    endpoint = endpoint_of(BusConfig())
    assert listen_words(BusConfig(), endpoint) == ("--listen", endpoint)
    assert endpoint != BusConfig().listen[0]
