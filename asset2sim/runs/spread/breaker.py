"""A circuit breaker: a model that fails asset after asset with the same error is not asked about the others."""

import re
from dataclasses import dataclass

from schemas.asset import AssetRecord
from schemas.vocabulary import FailureMode

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass
class Breaker:
    """Counts equal model errors in a row. ``most`` is how many break the circuit, 0 for none; ``broken`` says why it is
    broken, once it is."""

    most: int
    broken: str | None = None
    count: int = 0
    last: str = ""

    def see(self, record: AssetRecord) -> None:
        """Count a finished asset; one that ended otherwise begins the count anew, one that asked no model does not."""
        if self.broken is not None or self.most == 0:
            return
        if record.failure_mode is not FailureMode.MODEL_ERROR:
            if any(call.outcome == "ok" for call in record.calls):
                self.count = 0
            return
        error = kind_of_error(record)
        self.count = self.count + 1 if error == self.last else 1
        self.last = error
        if self.count >= self.most:
            self.broken = (
                f"the model failed {self.count} assets in a row with the same error, so the others were not tried; the "
                f"next run tries them: {record.reason}"
            )


def kind_of_error(record: AssetRecord) -> str:
    """A model error's text without what differs between assets: its id, and numbers such as times and request ids."""
    own = rf"(?<!\w){re.escape(record.ref.asset_id)}(?!\w)"
    return _NUMBER.sub("0", re.sub(own, "", record.reason))
