"""The README's questions, answered from a real run's catalog: ``python -m asset2sim.questions OUT README``."""

import sys
from pathlib import Path

from asset2sim.questions.answers import answers_block
from asset2sim.readme import with_block

BEGIN = "<!-- questions: begin (make questions) -->"
END = "<!-- questions: end -->"

if __name__ == "__main__":
    target = Path(sys.argv[2])
    text = with_block(target.read_text(encoding="utf-8"), answers_block(Path(sys.argv[1])), BEGIN, END)
    target.write_text(text, encoding="utf-8")
