"""Mutated scene texts through the loader: python -m tests.scene.fuzz --count 100000

Each case is made from (seed, number) alone, so that `--only NUMBER` shows one again. A reject must name file, line and column inside
the text; anything but a Scene or a SceneError is a traceback; more than a second of processor time is a hang.
"""

import argparse
import faulthandler
import json
import random
import re
import sys
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field

import jsonschema
import yaml

from tests.scene.samples import FOLDER, sample_texts
from warpsim.scene import SceneError, json_schema, load_text, resolved_yaml
from warpsim.scene.yaml12 import decode, parse

FILE = "fuzz.yaml"
HANG = 1.0
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_LIBRARY_WORDS = re.compile(r"Input should|Unable to|[Dd]iscriminator|Field required|valid dictionary|Value error|Extra inputs|<[a-z_]+>")
ODD_TOKENS = (
    *("null", "~", "true", "no", "1e400", "-1e-400", ".nan", "-.inf", "0x1F", "0o17", "010", "1_000", "1:30", "9" * 60, "1e5", "-0.0"),
    *("[", "]", "{", "}", ",", ":", ": ", "- ", "? ", "|", ">", "&a ", "*a", "*origin", "<<: ", "!!python/object:os.system ", "!", "%"),
    *('"', "'", "#", "@", "`", "\\", "\t", "\n", "\r", "\r\n", "\n\n  ", "---\n", "...\n", "%YAML 1.1\n", "é", "😀", "[" * 70),
    *("\ufeff", "\u2028", "\x85", "\x00", "\x1b", "tracer", "#ff", "feels", "type", '{expression: "t^"}', "{over_life: [[0, 1]]}"),
    *("{sine: {amplitude: 1}}", "{keyframes: []}"),
)
_TOKEN = re.compile(r"\w+|\s+|[^\w\s]")


@dataclass
class Report:
    """What came out of a run."""

    cases: int = 0
    accepted: int = 0
    rejected: int = 0
    problems: int = 0
    slowest: float = 0.0
    kinds: Counter = field(default_factory=Counter)
    tracebacks: list[str] = field(default_factory=list)
    hangs: list[str] = field(default_factory=list)
    misplaced: list[str] = field(default_factory=list)
    unequal: list[str] = field(default_factory=list)
    """Accepted, but not equal after being written out and loaded again, or refused by the JSON schema."""

    @property
    def clean(self) -> bool:
        """Whether every promise held."""
        return not (self.tracebacks or self.hangs or self.misplaced or self.unequal)


def case(number: int, seed: int, texts: list[str], words: list[str]) -> tuple[str, bytes]:
    """Return one mutated text as (kind of mutation, bytes)."""
    rng = random.Random(f"{seed}:{number}")
    text = rng.choice(texts)
    kind = rng.choice(("bytes", "tokens", "lines", "structure"))
    if kind == "bytes":
        return kind, _mutated_bytes(rng, text.encode())
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        text = {"tokens": _mutated_tokens, "lines": _mutated_lines, "structure": _mutated_structure}[kind](rng, text, words)
    return kind, text.encode("utf-8", "surrogatepass")


def _mutated_bytes(rng: random.Random, raw: bytes) -> bytes:
    data = bytearray(raw)
    for _ in range(rng.choice((1, 1, 2, 4, 16, 64))):
        at = rng.randrange(len(data) + 1)
        action = rng.randrange(5)
        if action == 0:
            data[at : at + 1] = bytes([rng.randrange(256)])
        elif action == 1:
            data[at:at] = bytes(rng.randrange(256) for _ in range(rng.choice((1, 1, 4))))
        elif action == 2:
            del data[at : at + rng.choice((1, 1, 3, 20, 200))]
        elif action == 3:
            data[at:at] = bytes([rng.choice(b"[]{}:,-#&*!|>'\"%@`\t\n ?~.0123456789eE+")])
        else:
            other = rng.randrange(len(data) + 1)
            data[at:at] = data[other : other + rng.choice((2, 10, 60))]
    return bytes(data)


def _mutated_tokens(rng: random.Random, text: str, words: list[str]) -> str:
    tokens = _TOKEN.findall(text) or [" "]
    at, other = rng.randrange(len(tokens)), rng.randrange(len(tokens))
    action = rng.randrange(6)
    if action == 0:
        del tokens[at : at + rng.choice((1, 1, 2, 6))]
    elif action == 1:
        tokens[at], tokens[other] = tokens[other], tokens[at]
    elif action == 2:
        tokens.insert(at, rng.choice(ODD_TOKENS))
    elif action == 3:
        tokens[at] = rng.choice(ODD_TOKENS)
    elif action == 4:
        tokens[at] = rng.choice(words)
    else:
        tokens[at] = _misspelled(rng, tokens[at])
    return "".join(tokens)


def _misspelled(rng: random.Random, word: str) -> str:
    at = rng.randrange(len(word) + 1)
    swapped = word[:at] + word[at : at + 2][::-1] + word[at + 2 :]
    return rng.choice((word[:at] + word[at + 1 :], swapped, word[:at] + "x" + word[at:], word.upper()))


def _mutated_lines(rng: random.Random, text: str, words: list[str]) -> str:
    lines = text.split("\n")
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    action = rng.randrange(6)
    if action == 0:
        del lines[at]
    elif action == 1:
        lines.insert(at, lines[other])
    elif action == 2:
        lines[at] = rng.choice((" ", "  ", "\t")) + lines[at]
    elif action == 3:
        lines[at] = lines[at][1:]
    elif action == 4:
        lines[at], lines[other] = lines[other], lines[at]
    else:
        lines = lines[: at + 1]
    return "\n".join(lines)


def _mutated_structure(rng: random.Random, text: str, words: list[str]) -> str:
    """Change one value or key of the parsed scene, guided by the schema's words, and write it out again."""
    try:
        data = parse(text, FILE)[0].data()
    except SceneError:
        return text
    places = list(_places(data))
    if not places:
        return text
    container, key = rng.choice(places)
    action = rng.randrange(5)
    if action == 0:
        del container[key]
    elif action == 1 and isinstance(container, dict):
        container[rng.choice((rng.choice(words), _misspelled(rng, str(key))))] = container.pop(key)
    elif action == 2 and isinstance(container, dict):
        container[rng.choice(words)] = _odd_value(rng, words)
    elif action == 3:
        container[key] = rng.choice(([container[key]], {"mean": container[key]}, [container[key]] * 3, {rng.choice(words): container[key]}))
    else:
        container[key] = _odd_value(rng, words)
    if rng.random() < 0.2:
        return json.dumps(data)
    style = rng.choice((None, True, False))
    return yaml.dump(data, Dumper=_DUMPER, sort_keys=False, default_flow_style=style, width=rng.choice((40, 120)))


def _places(data, depth: int = 0):
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield data, key
        if depth < 20:
            yield from _places(value, depth + 1)


def _odd_value(rng: random.Random, words: list[str]):
    return rng.choice(
        (
            *(None, True, False, 0, 1, -1, 3, 7.5, -2.5, 1e-9, 1e30, 2**70, 0.0, 1e5, "", "text", "tracer", "1", "2*t", "#123", "#12345"),
            *([], {}, [0], [0, 0, 0], [1, 2, 3, 4], [[0, 1]], [[0, 1], [0, 2]], {"mean": -1}, {"sine": {"amplitude": 1, "period": 0}}),
            *({"expression": "1/0"}, {"expression": "sin("}, {"keyframes": [[1, 1], [0, 0]]}, {"type": "vortex"}, {"over_life": [[0, 1]]}),
            *(rng.choice(words), {rng.choice(words): rng.choice(words)}, rng.uniform(-5, 5), rng.randrange(-5, 5), "x" * 300),
        )
    )


def schema_words(schema: dict) -> list[str]:
    """Return every key and choice of the format."""
    words = set()

    def collect(node):
        for key, value in node.items() if isinstance(node, dict) else ():
            if key == "properties":
                words.update(value)
            if key == "enum":
                words.update(value)
            if key == "const":
                words.add(value)
            collect(value)
        for item in node if isinstance(node, list) else ():
            collect(item)

    collect(schema)
    return sorted(words)


def check(name: str, raw: bytes, report: Report, validator: jsonschema.Draft202012Validator | None) -> None:
    """Load one text and book what came out; with a validator, look closer at what is accepted."""
    report.cases += 1
    begin = time.process_time()
    try:
        text = decode(raw, FILE)
        scene = load_text(text, FILE, folder=FOLDER)
        report.accepted += 1
        if validator and load_text(resolved_yaml(scene), folder=FOLDER) != scene:
            report.unequal.append(f"{name}: not equal after being written out and loaded again")
        if validator and (refused := next(validator.iter_errors(parse(text, FILE)[0].data()), None)):
            report.unequal.append(f"{name}: refused by the schema: {refused.json_path}: {refused.message[:200]}")
    except SceneError as error:
        report.rejected += 1
        report.problems += len(error.problems)
        reason = _misplaced(error, raw)
        if reason:
            report.misplaced.append(f"{name}: {reason}")
    except Exception:  # a RecursionError is exactly what is looked for
        report.tracebacks.append(f"{name}:\n{traceback.format_exc(limit=-6)}")
    took = time.process_time() - begin
    report.slowest = max(report.slowest, took)
    if took > HANG:
        report.hangs.append(f"{name}: {took:.2f} s")


def _misplaced(error: SceneError, raw: bytes) -> str | None:
    lines = re.split(r"\r\n|\r|\n", raw.decode("utf-8-sig", "replace"))
    if not error.problems or not str(error):
        return "no problem told"
    for problem in error.problems:
        if problem.file != FILE or not problem.message:
            return f"no file or message: {problem}"
        if _LIBRARY_WORDS.search(problem.message):
            return f"words of the library: {problem.message}"
        if not (1 <= problem.line <= len(lines) and 1 <= problem.column <= len(lines[problem.line - 1]) + 1):
            return f"outside of the text: {problem.headline}"
    return None


def run(count: int, seed: int = 0, first: int = 0) -> Report:
    """Load `count` mutated texts and return what came out."""
    report = Report()
    texts = list(sample_texts().values())
    schema = json_schema()
    words = schema_words(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for number in range(first, first + count):
        kind, raw = case(number, seed, texts, words)
        report.kinds[kind] += 1
        check(f"case {number} ({kind}, seed {seed})", raw, report, validator if number % 10 == 0 else None)
    return report


def main() -> int:
    """Run from the command line; exit status 1 when a promise broke."""
    parser = argparse.ArgumentParser(description="Mutated scene texts through the loader.")
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="print one case and what the loader says of it")
    options = parser.parse_args()
    faulthandler.dump_traceback_later(3600, exit=True)
    if options.only is not None:
        _, raw = case(options.only, options.seed, list(sample_texts().values()), schema_words(json_schema()))
        sys.stdout.buffer.write(raw + b"\n\n")
        try:
            print(load_text(decode(raw, FILE), FILE))
        except SceneError as error:
            print(error)
        return 0
    begin = time.perf_counter()
    report = run(options.count, options.seed)
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(report.kinds.items()))
    print(f"cases {report.cases} ({kinds}) in {time.perf_counter() - begin:.0f} s")
    print(f"accepted {report.accepted}, rejected {report.rejected} with {report.problems} problems, slowest {report.slowest * 1e3:.0f} ms")
    for title in ("tracebacks", "hangs", "misplaced", "unequal"):
        found = getattr(report, title)
        print(f"{title} {len(found)}")
        for line in found[:5]:
            print(f"  {line}")
    return 0 if report.clean else 1


if __name__ == "__main__":
    sys.exit(main())
