"""What an agent may use: every number that keeps its conversation and its tools within reason."""

MAX_ANSWER_CALLS = 8
"""Tool calls of one answer that are run; the rest is dropped and the model told so."""
MAX_CALLS = 60
"""Tool calls for one asset: five for each of the twelve answers of the default budget."""
MAX_SAME = 3
"""Identical answers in a row that end the conversation: the tools would return the same for ever."""
MAX_ARGUMENT_CHARS = 100_000
"""Longest arguments of one call that are looked at: an object of a thousand joints needs less."""
MAX_RESULT_CHARS = 16_000
"""Longest result of one tool, about 4000 tokens."""
MAX_SAID_CHARS = 4_000
"""Longest text of the model's own that goes back to it with the conversation."""
MAX_TALK_CHARS = 160_000
"""Longest conversation, about 40,000 tokens; beyond it the oldest results and arguments are left out."""
MAX_ROOMLESS_CHARS = 200
"""Arguments up to this length stay even then."""
MAX_ID_CHARS = 20_000
"""Longest identifier of a call that is kept: some providers put their model's signed thoughts into it."""
MAX_QUOTED_CHARS = 200
"""How much of something wrong is quoted in an error."""
MAX_ROWS = 40
"""Joints, links or pairs that one result lists."""
MAX_NOTES = 10
"""Notes that are kept of what the model says when it finishes ..."""
MAX_NOTE_CHARS = 500
"""... and the longest of them."""
TOOL_LIMIT_S = 60.0
"""Wall time of one simulation, rendering or reading of contacts, s; its process is killed then."""
TOOL_SHARE = 0.5
"""Share of the asset's time limit that all tools together may take: the rest is for the judgement."""
MIN_TOOL_S = 1.0
"""With less time left than this, s, no tool is started."""
