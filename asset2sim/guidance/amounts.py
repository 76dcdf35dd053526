"""Numbers in the guidance in the plain units that the rules read, or left out and named if they cannot be met."""

import re
from decimal import Decimal
from functools import lru_cache

from schemas.guidance import AskedMass, UnmetNumber

SMALLEST_M, LARGEST_M = 0.005, 5.0
"""The longest edge that a household object may have after scaling, m: a button cell to a wardrobe wall."""
LEAST_SCALE, MOST_SCALE = 1e-4, 1e4
"""Uniform scales that can be meant: metres for a tenth of a millimetre, and the reverse."""
MOST_KG = 1e4
"""The most that an object may be said to weigh, kg: a safe of ``LARGEST_M`` has a tenth of it."""

NEAR = 60
"""Characters before and after a number that say what it is about."""

_METRES = {
    "km": 1e3, "kilometres?": 1e3, "kilometers?": 1e3, "miles?": 1609.344, "yards?": 0.9144, "yd": 0.9144,
    "feet": 0.3048, "foot": 0.3048, "ft": 0.3048, "dm": 0.1, "decimet(?:re|er)s?": 0.1, "µm": 1e-6, "um": 1e-6,
    "microns?": 1e-6, r"in(?=\s+(?:long|wide|tall|high|deep|thick|across)\b)": 0.0254,
}  # fmt: skip
_KILOGRAMS = {
    "lbs?": 0.45359237, "pounds?": 0.45359237, "ounces?": 0.028349523125, "oz": 0.028349523125, "tons?": 1e3,
    "tonnes?": 1e3, "mg": 1e-6, "stones?": 6.35029318,
}  # fmt: skip
_NEWTON_METRES = {
    r"mn[\s·⋅.*-]?m": 1e-3, r"n[\s·⋅.*-]?cm": 0.01, r"n[\s·⋅.*-]?mm": 1e-3, r"n[\s·⋅.*-]?m": 1.0,
    r"newton[\s-]?met(?:re|er)s?": 1.0, r"(?:ft|foot)[\s·-]?(?:lbf?s?|pounds?)": 1.355818,
    r"in[\s·-]?(?:lbf?s?|pounds?)": 0.112985,
}  # fmt: skip
_NEWTONS = {
    "newtons?": 1.0, "mn": 1e-3, "cn": 0.01, "kn": 1e3, "n": 1.0, "kgf": 9.80665, "gf": 9.80665e-3, "lbf": 4.448222,
    r"pounds?(?=\s+of\s+force\b)": 4.448222, r"grams?(?=\s+of\s+force\b)": 9.80665e-3,
}  # fmt: skip
_PLAIN = {
    "m": {"m": 1.0, "met(?:re|er)s?": 1.0, "cm": 0.01, "centimet(?:re|er)s?": 0.01, "mm": 0.001,
          "millimet(?:re|er)s?": 0.001, "inch(?:es)?": 0.0254},
    "kg": {"kg": 1.0, "kilograms?": 1.0, "kilos?": 1.0, "g": 0.001, "grams?": 0.001},
    "rad": {"deg(?:rees?)?": 0.0174532925199, "°": 0.0174532925199, "rad(?:ians?)?": 1.0},
    "%": {"%": 0.01, "percent": 0.01},
}  # fmt: skip
"""Units that the rules read themselves, by the SI unit in which they measure: these are left as they stand."""
_UNITS = "|".join(
    (*_NEWTON_METRES, *_NEWTONS, *_METRES, *_KILOGRAMS, *(unit for units in _PLAIN.values() for unit in units))
)
_AMOUNT = re.compile(
    r"(?P<sign>(?<![\w.,%°)])[-−–](?=\d)|\bminus\s+)?(?<![\w.,])"
    r"(?P<digits>\d++(?:[.,]\d++)*+)(?P<power>e[-+]?\d++|\^[-+]?\d++|[⁻⁰¹²³⁴-⁹]++)?+(?P<ratio>:\d++)?+"
    rf"(?:(?P<space>\s*-?\s*)(?P<unit>{_UNITS})(?![a-z0-9]))?"
)
_SCALED = re.compile(r"\bscal(?:e|ed|ing)(?:\s+(?:factor|of|to|by|is|it|up|down))*\s*[:=]?\s*$")
_SIZED = re.compile(r"[\s-]*(?:long|wide|tall|high|deep|across|in\s+(?:length|width|height|depth|diameter))\b")
_OPENED = re.compile(r"[\s-]*(?:open|closed|shut|of\s+the\s+way)\b")
_OPENS = re.compile(r"\bopen(?:ed)?(?:\s+(?:by|to|at))?\s*$")
_SPELT_NUMBERS = {
    word: float(number)
    for number, words in enumerate(
        ("", "a an one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
    )
    for word in words.split()
}
_SPELT = re.compile(
    rf"\b(?:(?P<part>half|(?:a\s+)?quarter\s+of|three\s+quarters\s+of)\s+)?(?P<word>{'|'.join(_SPELT_NUMBERS)})"
    r"(?:\s+and\s+a\s+(?P<more>half|quarter))?[\s-]+(?P<unit>(?:centi|milli)?met(?:re|er)s?|inch(?:es)?"
    r"|kilo(?:gram)?s?|pounds?|ounces?|stones?|(?<=of\sa\s)ton(?:ne)?|(?<=half\sa\s)ton(?:ne)?|feet"
    r"|(?<=-)foot|foot(?=\s+(?:long|wide|tall|high|deep|across|open|in)\b)|(?<=open\sa\s)foot|(?<=about\sa\s)foot|(?<=by\sa\s)foot)"
    r"(?:\s+and\s+a\s+(?P<rest>half|quarter))?\b"
)
"""Amounts in words: "a metre long", "half a kilo", "two and a half pounds", "a kilo and a half", "open about a foot";
else "a foot" may be one to stand on, and "a ton" only much."""
_PARTS_OF_ONE = {"h": 0.5, "q": 0.25, "a": 0.25, "t": 0.75}
"""By their first letter: half, quarter, a quarter, three quarters."""
_INCH_FRACTION = re.compile(
    r"(?<![\w.,/])(?:(?P<whole>\d+)[\s-]+)?(?P<over>\d)\s?[/⁄]\s?(?P<under>\d{1,2})"
    r"(?:(?P<state>\s(?=open|closed|shut|of\sthe\sway))"
    r"|(?=[\s-]*(?:\"|″|inch|in\b|feet|foot|ft|pounds?|lbs?|oz|ounces?|kg|kilos?|cm|m\b)))"
)
"""A fraction of a unit, or of an opening: "27 1/2 inches", "1/3 open"."""
_GLYPHS = {"½": " 1/2", "¼": " 1/4", "¾": " 3/4", "⅛": " 1/8", "⅜": " 3/8", "⅝": " 5/8", "⅞": " 7/8"}
_FEET_INCHES = re.compile(
    r"(?<![\w.,])(\d+(?:\.\d+)?)\s*(?:'|′|ft\b\.?|feet|foot)(?:[\s,-]|and\s)*(\d+(?:\.\d+)?)\s*(?:\"|″|''|in\b\.?|inch(?:es)?)"
)
_FEET = re.compile(r"(?<![\w.,'′])(\d+(?:\.\d+)?)\s?(?:'|′)(?=[\s,.;)-]|$)")
"""Feet as a mark, and no quotation's end: of the drawer 'joint_1', or of number '2'."""
_POUNDS_OUNCES = re.compile(
    r"(?<![\w.,])(\d+(?:\.\d+)?)\s*(?:lbs?\b\.?|pounds?)(?:[\s,]|and\s)*(\d+(?:\.\d+)?)\s*(?:oz\b|ounces?)"
)
_SHORTENED = re.compile(r"(?<=\d)(\s?(?:in|ft|yd|cm|mm|m))\.(?=\s+(?:long|wide|tall|high|deep|thick|across|in\b))")
"""A unit with the full stop of its abbreviation, which ends no sentence: "8 in. tall"."""
_EDGE = r"(\d+(?:\.\d+)?)\s*(cm|mm|m|centimet(?:re|er)s?|millimet(?:re|er)s?|met(?:re|er)s?|inch(?:es)?|in|ft|feet)?"
_EDGES = re.compile(rf"(?<![\w.,]){_EDGE}\s*(?:x|×|by)\s*{_EDGE}(?:\s*(?:x|×|by)\s*{_EDGE})?(?![\w.])")
"""Two or three edges: "20 by 15 by 10 cm", "80cm x 70cm x 35cm"."""
_INCHES = re.compile(r"(?<=\d)\s?(?:\"|″)(?=[\s,.;)-]|$)")
_DIAGONAL = re.compile(
    r"(?<![\w.,])(\d+(?:\.\d+)?)[\s-]*inch(?:es)?[\s-]+(?:diagonal\b|(?=(?:(?!tall|wide|high|deep|long)[\w-]+\s+){0,2}"
    r"(?:laptop|notebook|ultrabook|macbook|monitor|tv|television|screen|display|tablet)s?\b))"
)
"""A length in inches before what has a screen is the screen's diagonal: "a 15.6-inch gaming laptop"."""
WIDTH_OF_DIAGONAL_M = 0.0254 * 0.9
"""Width of the thing around a screen, m an inch of diagonal: 0.85 to 0.87 of it at 16:10 and 16:9, and the bezels."""
_THOUSANDS = re.compile(r"[1-9]\d{0,2}(?:,\d{3})+")
_NUMBER = re.compile(rf"\d+(?:[.,]\d+)?|{_THOUSANDS.pattern}")
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_MASS = re.compile(
    r"(\d++(?:\.\d++)?+)\s*(kg|kilograms?|kilos?|g|grams?)\b(?!\s+(?:of\b|(?:max\w*\s+)?(?:capacity|load|payload)))"
)
_HOLDS = re.compile(
    r"\b(?:capacity|load|payload|hold(?:s|ing)?|carr(?:y|ies|ying)|bears?|supports?|takes?)(?:\s+(?:of|is|up|to|at|most|about))*"
    r"\s*:?\s*$"
)


def plain_guidance(guidance: str) -> str:
    """The guidance in lower case, its numbers without exponents, decimal commas and units that no rule reads ("1e-1 m"
    and "3 ft" become "0.1 m" and "0.9144 m"), and without those that cannot be met."""
    return _read(guidance)[0]


def unmet_numbers(guidance: str) -> tuple[UnmetNumber, ...]:
    """The numbers that no object can have: negative ones, sizes of kilometres, scales of a billion."""
    return _read(guidance)[1]


def asked_masses(guidance: str) -> tuple[AskedMass, ...]:
    """The masses that the guidance states of the object, kg, the first of which counts; not those of what it holds or
    carries ("8 kg capacity", "1 kg of tea")."""
    text = plain_guidance(guidance)
    return tuple(
        AskedMass(words=found.group(), mass_kg=float(found.group(1)) * (1.0 if found.group(2)[0] == "k" else 1e-3))
        for found in _MASS.finditer(text)
        if float(found.group(1)) > 0.0 and not _HOLDS.search(text[: found.start()])
    )


def _in_digits(found: "re.Match[str]") -> str:
    """An amount in words as a number with its unit."""
    more = found["more"] or found["rest"]
    amount = _SPELT_NUMBERS[found["word"]] + (_PARTS_OF_ONE[more[0]] if more else 0.0)
    return f"{_decimal(amount * (_PARTS_OF_ONE[found['part'][0]] if found['part'] else 1.0))} {found['unit']}"


def _without_fractions(found: "re.Match[str]") -> str:
    """A whole number and a fraction as one decimal number; as it stands where it is no fraction."""
    whole, over, under = float(found["whole"] or 0), float(found["over"]), float(found["under"])
    if under <= over:
        return found.group()
    if found["state"]:
        return f"{_decimal(100.0 * over / under)} %{found['state']}"
    return _decimal(whole + over / under)


def _in_one_unit(text: str) -> str:
    """The text with feet and inches, and pounds and ounces, each as one amount: "5'8\"" becomes "68 inch"."""
    for glyph, fraction in _GLYPHS.items():
        text = text.replace(glyph, fraction)
    text = _SHORTENED.sub(r"\1", _INCH_FRACTION.sub(_without_fractions, text))
    text = _FEET_INCHES.sub(lambda found: f"{_decimal(12.0 * float(found[1]) + float(found[2]))} inch", text)
    text = _POUNDS_OUNCES.sub(lambda found: f"{_decimal(16.0 * float(found[1]) + float(found[2]))} oz", text)
    return _INCHES.sub(" inch", _FEET.sub(r"\1 ft", text))


def _longest(found: "re.Match[str]") -> str:
    """The longest of two or three edges as a length; which one is the height is not stated."""
    digits, units = found.groups()[::2], found.groups()[1::2]
    last = next((unit for unit in reversed(units) if unit), None)
    if last is None:
        return found.group()
    edges = [(digit, unit or last) for digit, unit in zip(digits, units, strict=True) if digit]
    longest, unit = max(edges, key=lambda edge: float(edge[0]) * _unit(edge[1], " long")[1])
    return f"{longest} {'inches' if unit == 'in' else unit} long"


@lru_cache(maxsize=64)
def _read(guidance: str) -> tuple[str, tuple[UnmetNumber, ...]]:
    text = _in_one_unit(_SPELT.sub(_in_digits, guidance.lower().replace("\u2019", "'")))
    text = _DIAGONAL.sub(lambda found: f"{_decimal(float(found[1]) * WIDTH_OF_DIAGONAL_M)} m wide ", text)
    text, pieces, unmet, end = _EDGES.sub(_longest, text), list[str](), list[UnmetNumber](), 0
    for found in _AMOUNT.finditer(text):
        before, after = text[max(found.start() - NEAR, 0) : found.start()], text[found.end() : found.end() + NEAR]
        word, why = _rewritten(found, before, after)
        if why:
            scaled, rest = _SCALED.search(before), _SIZED.match(after) or _OPENED.match(after)
            words = (scaled.group() if scaled else "") + found.group() + (rest.group() if rest else "")
            unmet.append(UnmetNumber(words=words.strip(), why=why))
        pieces += [text[end : found.start()], word]
        end = found.end()
    return "".join((*pieces, text[end:])), tuple(unmet)


def _rewritten(found: "re.Match[str]", before: str, after: str) -> tuple[str, str]:
    """An amount in plain words, "" if it cannot be met, and then why."""
    scales = _SCALED.search(before) is not None
    if (found["ratio"] and not scales) or not _NUMBER.fullmatch(found["digits"]):
        return found.group(), ""  # a time, a version, a list
    value, (unit, factor) = _value(found["digits"], found["power"]), _unit(found["unit"], after)
    # "10 -20 cm" is a range.
    if found["sign"] is not None and not before.rstrip()[-1:].isdigit():
        return "", "no amount is negative"
    if value is None:
        return "", "it is beyond all numbers"
    if scales and found["ratio"]:
        return "", "a ratio is no scale of a file; state the size, as in 20 cm long"
    scale = scales and unit in ("", "%")
    why = _too_much("scale" if scale else unit, value * factor, before, after)
    if why:
        return "", why
    if scale:
        return _decimal(value * factor), ""
    if unit and not any(re.fullmatch(name, found["unit"]) for units in _PLAIN.values() for name in units):
        return f"{_decimal(value * factor)} {unit}", ""
    space = " " if "-" in (found["space"] or "") else found["space"] or ""
    return f"{_decimal(value)}{space}{found['unit'] or ''}", ""


def _too_much(unit: str, amount: float, before: str, after: str) -> str:
    """Why no object has an amount, which is in ``unit``; empty where one may."""
    if unit == "scale" and not LEAST_SCALE <= amount <= MOST_SCALE:
        return f"a scale is {LEAST_SCALE:g} to {MOST_SCALE:g}"
    if unit == "m" and (amount > LARGEST_M or (amount < SMALLEST_M and _SIZED.match(after))):
        return f"objects are {1e3 * SMALLEST_M:g} mm to {LARGEST_M:g} m"
    if unit == "kg" and not 0.0 < amount <= MOST_KG:
        return f"objects weigh more than nothing and at most {MOST_KG:g} kg"
    if unit == "%" and amount > 1.0 and (_OPENED.match(after) or _OPENS.search(before)):
        return "fully open is 100 %"
    return ""


def _unit(name: str | None, after: str) -> tuple[str, float]:
    """SI unit of a unit's name before the words ``after`` it, and its factor; "" for none."""
    if name is None:
        return "", 1.0
    read = {"newtonmetres": _NEWTON_METRES, "newtons": _NEWTONS, "m": _METRES, "kg": _KILOGRAMS}
    for unit, units in (*read.items(), *_PLAIN.items()):
        for pattern, factor in units.items():
            found = re.match(pattern, name + after)
            if found is not None and found.end() == len(name):
                return unit, factor
    return "", 1.0


def _value(digits: str, power: str | None) -> float | None:
    """The number as written; None where it is beyond what a float holds."""
    digits = digits.replace(",", "") if _THOUSANDS.fullmatch(digits) else digits.replace(",", ".")
    try:
        value = float(digits)
        if power and power[0] == "e":
            value = float(digits + power)
        elif power:
            value = value ** int(power.translate(_RAISED).lstrip("^"))
    except (OverflowError, ValueError, ZeroDivisionError):
        return None
    return value if value < 1e300 else None


def _decimal(value: float) -> str:
    return format(Decimal(f"{value:.10g}"), "f")
