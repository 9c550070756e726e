"""What the two pages of a study ask for."""

from pathlib import Path

import msgspec

from services.study.asks import Asks
from services.study.forms import items_of, lacks_of
from services.study.view import Ask, Reply, parse_participant_ask, parse_researcher_ask
from shared.errors import MessageError
from shared.study.protocol_file import load_protocol, shipped_protocol
from tests.fuzz import formats
from tests.fuzz.target import Target

RESEARCHER = (
    b'{"id":"0a1b","action":"begin","step":""}',
    b'{"id":"9f-3","action":"void","step":"s1-g02","attempt":2,"reason":"over the line"}',
    b'{"id":"77","action":"note","step":"s2-g01","text":"smiled \\u00fc \\n"}',
)
PARTICIPANT = (
    b'{"id":"0a","action":"ready","step":"instruction","answers":[]}',
    b'{"id":"1b","action":"answers","step":"q-tam","answers":[{"item":"PU","value":4},'
    b'{"item":"PEOU","value":1},{"item":"adjectives","choices":["Boring"],"text":"x"}]}',
    b'{"id":"2c","action":"ranking","step":"s4-r-comparison","answers":'
    b'[{"item":"enjoyment","ranks":[3,2,3,1]},{"item":"difficulty","ranks":[1,1,2,2]}]}',
)


def targets(folder: Path) -> list[Target]:
    """Return both."""
    protocol = load_protocol(shipped_protocol("study-one"))
    forms = [items_of(instrument, (1, 2, 3, 4)) for instrument in protocol.instrument]

    def once(ask: Ask) -> Reply | None:
        asks = Asks()
        asks.put(ask)
        asks.put(ask)
        if asks.take() != ask or asks.take() is not None:
            raise AssertionError("an ask is let through once")
        asks.answer(Reply(id=ask.id, is_done=True, lines=(ask.step,)))
        return asks.put(ask)

    def researcher(data: bytes) -> object:
        return msgspec.json.encode(once(parse_researcher_ask(data)))

    def participant(data: bytes) -> object:
        ask = parse_participant_ask(data)
        lacks = [lacks_of(items, ask.answers) for items in forms]
        return msgspec.json.encode(once(ask)), msgspec.json.encode((ask, lacks))

    return [
        Target("pages/researcher", researcher, RESEARCHER, formats.json_text, (MessageError,),
               ("services.study.view:parse_researcher_ask",)),
        Target("pages/participant", participant, PARTICIPANT, formats.json_text, (MessageError,),
               ("services.study.view:parse_participant_ask",), weight=2),
    ]  # fmt: skip
