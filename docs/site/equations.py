"""Formulas as docs/EQUATIONS.md has them, in one line of plain text, typeset as MathML.

Nothing is rearranged: every sign of the text stands in the formula in the same order. A quotient becomes a fraction only
where its parts are plain: of what stands close to the solidus (`a b/c d` is a (b/c) d), or, with spaces around it, of all
of the term. Where more than one reading is left the solidus stays.
"""

from __future__ import annotations

import html
import re
import unicodedata
from dataclasses import dataclass, field
from xml.etree import ElementTree

FUNCTIONS = {"acos", "atan", "atan2", "cos", "cosh", "exp", "floor", "ln", "max", "mean", "median", "min", "sign", "sin",
             "tanh", "diag", "RMS", "probability"}
GREEK = {"alpha": "α", "beta": "β"}
# Of more than one letter, and one name all the same.
WORDS = {"axis", "base", "bias", "bw", "capacity", "draws", "erpm", "Kv", "out", "pu", "sd", "spread", "target", "torque",
         "band", "load", "rad", "ms", "healthy", "white", "late", "rpm", "sd"}
SUPER = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺ᵗᵀⁿ", "0123456789−+tTn"))
SUB = dict(zip("₀₁₂₃₄₅₆₇₈₉₋₊", "0123456789−+"))
ACCENTS = {"\u0304": "¯", "\u0302": "^", "\u0303": "~", "\u0307": "˙"}
RELATIONS = set("=≈≤≥<>→←∝∈")
OPERATORS = RELATIONS | set("+−±∓·×,;:…*!–") | {"-"}
# A letter, and none of the raised, lowered and broken ones that count as such.
L = r"[^\W\d_⁰¹²³⁴⁵⁶⁷⁸⁹ᵗᵀⁿ₀-₉½¼¾⅓⅔]"
OPEN, CLOSE = "([{⟨", ")]}⟩"


@dataclass
class Node:
    """A piece of MathML, and what its neighbours must know of it."""

    kind: str  # mi mn mo mrow mfrac msqrt msup msub msubsup mover
    children: list["Node"] = field(default_factory=list)
    text: str = ""
    attributes: str = ""
    spaced: bool = False  # a space stands before it
    function: bool = False  # takes what follows as its argument
    big: bool = False  # a sum or an integral
    fenced: bool = False  # stands in brackets of its own
    applied: bool = False  # a function with its brackets
    listed: bool = False  # a sign that belongs to the number behind it, in a list of numbers

    def mathml(self) -> str:
        if not self.children:
            inner = html.escape(self.text)
        elif self.kind in ("mrow", "msqrt"):
            inner = row_mathml(self.children)
        else:
            inner = "".join(child.mathml() for child in self.children)
        return f"<{self.kind}{self.attributes}>{inner}</{self.kind}>"


def row_mathml(nodes: list[Node]) -> str:
    """Factors that a space parts stay a little apart, and words more."""
    out = ""
    for n, node in enumerate(nodes):
        before = nodes[n - 1] if n else None
        if before is not None and "mo" not in (node.kind, before.kind):
            if node.spaced or before.function or node.function or before.applied:
                wide = before.function or len(before.text) > 2 or len(node.text) > 2 and not node.function
                # Numbers of a list, `1 −4 6`, must not become one.
                width = 0.6 if before.kind == node.kind == "mn" else 0.3 if wide else 0.14
                out += f'<mspace width="{width}em"/>'
        elif before is not None and node.listed:
            out += '<mspace width="0.6em"/>'
        out += node.mathml()
    return out


def mo(text: str, attributes: str = "") -> Node:
    return Node("mo", text=text, attributes=attributes)


def word(text: str) -> Node:
    if text in GREEK:
        return Node("mi", text=GREEK[text])
    if text in FUNCTIONS:
        return Node("mi", text=text, function=True)
    return Node("mi", text=text, attributes="" if len(text) == 1 else ' mathvariant="normal"')


def letter(token: str) -> Node:
    """One letter, with its accents."""
    plain = unicodedata.normalize("NFD", token)
    base, marks = plain[0], [ACCENTS[mark] for mark in plain[1:]]
    node = Node("mi", text=base)
    for mark in marks:
        node = Node("mover", [node, mo(mark, ' stretchy="false"')], attributes=' accent="true"')
    return node


def names_of(text: str) -> list[str]:
    """A run of letters as names: a word of its own, or letters that stand side by side."""
    if text in WORDS or text in FUNCTIONS or text in GREEK:
        return [text]
    for function in FUNCTIONS:
        rest = text.removeprefix(function)
        if rest != text and not rest.isascii():
            return [function, *names_of(rest)]
    bare = [c for c in unicodedata.normalize("NFC", text)]
    if len(bare) > 2 and text.isascii():
        return [text]
    return re.findall(rf"{L}[\u0300-\u036f]*", text)


class Reader:
    """A formula's text to nodes."""

    def __init__(self, text: str) -> None:
        self.text = unicodedata.normalize("NFC", text)
        self.at = 0

    def more(self) -> bool:
        return self.at < len(self.text)

    def peek(self, length: int = 1) -> str:
        return self.text[self.at : self.at + length]

    def take(self, pattern: str) -> str:
        match = re.compile(pattern).match(self.text, self.at)
        if not match:
            return ""
        self.at = match.end()
        return match[0]

    def spaces(self) -> bool:
        return bool(self.take(r"\s+"))

    def row(self, closing: str = "") -> list[Node]:
        """Up to a closing bracket, which stays."""
        nodes: list[Node] = []
        while True:
            spaced = self.spaces()
            if not self.more() or (closing and self.peek() in closing):
                return divided(signed(nodes))
            for n, node in enumerate(self.atoms()):
                node.spaced = spaced if n == 0 else False
                nodes.append(node)

    def bracket(self) -> Node:
        opening = self.take(".")
        close = CLOSE[OPEN.index(opening)]
        inner = self.row(close)
        if not self.take(re.escape(close)):
            raise ValueError(f"no {close} in `{self.text}`")
        return Node("mrow", [mo(opening), *inner, mo(close)], fenced=True)

    def root(self) -> Node:
        if self.peek() == "(":
            inside = self.bracket()
            return Node("msqrt", inside.children[1:-1])
        return Node("msqrt", self.atoms())

    def differential(self) -> Node | None:
        match = re.compile(rf"[d∂](?={L})").match(self.text, self.at)
        if not match:
            return None
        before = self.text[self.at - 1] if self.at else " "
        run = re.compile(rf"{L}+").match(self.text, self.at)
        if before.isalpha() or self.peek() == "d" and (not run or len(run[0]) > 2 or run[0] in WORDS):
            return None
        sign = Node("mi", text=self.take(".")) if self.peek() == "d" else mo(self.take("."), ' form="prefix"')
        return Node("mrow", [sign, *self.scripted(self.name())])

    def name(self) -> list[Node]:
        run = self.take(rf"(?:{L}[\u0300-\u036f]*)+")
        if run in ("atan",) and self.peek() == "2":
            run += self.take("2")
        if re.fullmatch(r"j[a-z]", run):
            return [letter("j"), letter(run[1])]
        nodes = [letter(name) if len(unicodedata.normalize("NFC", name)) == 1 or not name.isascii() else word(name)
                 for name in names_of(run)]
        # c12 is c with an index.
        if not nodes[-1].function and (digits := self.take(r"\d+")):
            nodes[-1] = Node("msub", [nodes[-1], Node("mn", text=digits)])
        return nodes

    def atoms(self) -> list[Node]:
        """One token; more where letters stand side by side."""
        c = self.peek()
        if differential := self.differential():
            return [differential]
        if c in OPEN:
            return self.scripted([self.bracket()])
        if c == "√":
            self.at += 1
            return [self.root()]
        if c.isdigit():
            number = self.take(r"\d+(?:\.\d+)?(?:e-?\d+(?!\w))?(?: 000)?")
            if power := re.fullmatch(r"([\d.]+)e(-?)(\d+)", number):
                sign = "−" if power[2] else ""
                return [Node("mn", text=power[1]), mo("·"), Node("msup", [Node("mn", text="10"), Node("mn", text=sign + power[3])])]
            return self.scripted([Node("mn", text=number)])
        if c in "½¼¾⅓⅔":
            self.at += 1
            top, bottom = unicodedata.normalize("NFKD", c).split("⁄")
            return [Node("mfrac", [Node("mn", text=top), Node("mn", text=bottom)])]
        if c in "Σ∫":
            self.at += 1
            return self.scripted([Node("mo", text="∑" if c == "Σ" else c, big=True)])
        if unicodedata.normalize("NFD", c)[0].isalpha():
            return self.scripted(self.name())
        if joined := self.take(r"[+−-]="):
            return [mo(joined)]
        self.at += 1
        if c == "|":
            return self.scripted([mo("|", ' stretchy="false" lspace="0" rspace="0"')])
        if c in OPERATORS or c == "/" or c == "%" or c in "∂Δ°″∞∓'":
            return [mo("−" if c == "-" else c)]
        raise ValueError(f"`{self.text}`: what is {c!r}?")

    def scripted(self, nodes: list[Node]) -> list[Node]:
        """Indices, powers and primes go to the last of what stands side by side."""
        node = nodes[-1]
        below: list[Node] = []
        above: list[Node] = []
        plain_end = self.at
        while self.more():
            if self.take("_"):
                below += self.index()
            elif marks := self.take(f"[{''.join(SUB)}]+"):
                below.append(mo("".join(SUB[m] for m in marks)))
            elif marks := self.take(f"[{''.join(SUPER)}]+"):
                text = "".join(SUPER[m] for m in marks)
                above += [Node("mn" if text.lstrip("−").isdigit() else "mi", text=text)]
            elif self.peek() == "^":
                self.at += 1
                above += self.exponent()
            elif marks := self.take("'+"):
                above.append(mo("′" * len(marks)))
            elif self.peek() == "!":
                # Of all that stands before it, which a fraction's bar must not part from it.
                self.at += 1
                node = Node("mrow", [node, mo("!", ' lspace="0" rspace="0"')])
                plain_end = self.at
                nodes = [*nodes[:-1], node]
            elif self.peek() == "*" and (self.at + 1 == len(self.text) or not self.text[self.at + 1].isalnum()):
                self.at += 1
                above.append(mo("∗"))
            else:
                break
        if self.at == plain_end:
            if node.function and self.peek() == "(":
                return [*nodes[:-1], *self.scripted([Node("mrow", [node, self.bracket()], applied=True)])]
            return nodes
        grouped = [node, *([one(below)] if below else []), *([one(above)] if above else [])]
        kind = "msubsup" if below and above else "msub" if below else "msup"
        out = Node(kind, grouped, function=node.function, big=node.big)
        if node.big and below:
            kind = "munderover" if above else "munder"
            out = Node(kind, grouped, big=True)
        if out.function and self.peek() == "(":
            out = Node("mrow", [out, self.bracket()], applied=True)
        return [*nodes[:-1], out]

    def index(self) -> list[Node]:
        if self.peek() == "{":
            return self.bracket().children[1:-1]
        if digits := self.take(r"\d+"):
            return [Node("mn", text=digits)]
        run = self.take(rf"(?:{L}|[\u0300-\u036f])+\d*")
        if not run:
            raise ValueError(f"no index after _ in `{self.text}`")
        nodes = [Node("mi", text=run, attributes="" if len(run) == 1 else ' mathvariant="normal"')]
        # x_base_i, s_b,k, k_i of a power: further indices without a space.
        while re.compile(rf"[,_]{L}").match(self.text, self.at):
            mark = self.take("[,_]")
            if mark == ",":
                nodes.append(mo(",", ' lspace="0" rspace="0"'))
            else:
                nodes.append(mo(",", ' lspace="0" rspace="0" data-mark="_"'))
            further = self.take(rf"{L}+\d*")
            nodes.append(Node("mi", text=further, attributes="" if len(further) == 1 else ' mathvariant="normal"'))
            if re.compile(r"[−+]\d").match(self.text, self.at) and mark == ",":
                nodes += [mo(self.take(".")), Node("mn", text=self.take(r"\d+"))]
        return nodes

    def exponent(self) -> list[Node]:
        if self.peek() == "{":
            return self.bracket().children[1:-1]
        if self.peek() == "(":
            return self.bracket().children[1:-1]
        sign = [mo(self.take("[−-]"))] if self.peek() in "−-" else []
        if self.peek() in "½¼⅓":
            return sign + self.atoms()
        if digits := self.take(r"\d+(?:\.\d+)?"):
            return [*sign, Node("mn", text=digits)]
        nodes = self.name()
        if self.take("_"):
            nodes[-1] = Node("msub", [nodes[-1], one(self.index())])
        return sign + nodes


def signed(nodes: list[Node]) -> list[Node]:
    """A sign before a term stands close to it."""
    for n, node in enumerate(nodes):
        if node.kind == "mo" and node.text in ("−", "+", "±", "∓") and n + 1 < len(nodes):
            if n == 0 or (ends_term(nodes[n - 1]) and nodes[n - 1].text != "|"):
                node.attributes = ' form="prefix" lspace="0" rspace="0"'
            elif node.spaced and not nodes[n + 1].spaced and nodes[n - 1].kind == "mn":
                node.attributes = ' form="prefix" lspace="0" rspace="0"'
                node.listed = True
    return nodes


def one(nodes: list[Node]) -> Node:
    return nodes[0] if len(nodes) == 1 else Node("mrow", nodes)


def bare(nodes: list[Node]) -> Node:
    """Without brackets that a fraction's bar replaces."""
    if len(nodes) == 1 and nodes[0].fenced and nodes[0].children[0].text == "(":
        return Node("mrow", nodes[0].children[1:-1])
    return one(nodes)


def ends_term(node: Node) -> bool:
    return node.kind == "mo" and (node.text in OPERATORS or node.text in ("/", "|", "+=", "−=")) and not node.big


def divided(nodes: list[Node]) -> list[Node]:
    """Fractions where there is one reading."""
    out = list(nodes)
    for at in range(len(nodes) - 1, -1, -1):
        if not (out[at].kind == "mo" and out[at].text == "/"):
            continue
        if at == 0 or at + 1 == len(out):
            continue
        loose = out[at].spaced and out[at + 1].spaced
        first = at - 1
        last = at + 1
        if ends_term(out[first]) or ends_term(out[last]) or out[last].big:
            continue
        if loose:
            while first > 0 and not ends_term(out[first - 1]) and not out[first - 1].big:
                first -= 1
            while last + 1 < len(out) and not ends_term(out[last + 1]):
                last += 1
        else:
            while first > 0 and not out[first].spaced and not ends_term(out[first - 1]) and not out[first - 1].big:
                first -= 1
            while last + 1 < len(out) and not out[last + 1].spaced and not ends_term(out[last + 1]):
                last += 1
        over, under = out[first:at], out[at + 1 : last + 1]
        several = not loose and len(under) > 1
        # `sin x/y`, `ln a/b`: which of two is divided only spaces tell.
        open_function = not loose and (over[-1].function or (first > 0 and out[first - 1].function))
        chained = any(n.kind == "mo" and n.text == "/" for n in (*out[first - 1 : first], *out[last + 1 : last + 2]))
        if several or open_function or chained or any(n.big or n.function for n in under) or any(n.big for n in over):
            continue
        fraction = Node("mfrac", [bare(over), bare(under)], spaced=over[0].spaced)
        out[first : last + 1] = [fraction]
        return divided(out)
    return out


# What a long formula may be broken before, where the page is narrow.
BREAKS = RELATIONS | set("+−,;·")
SHORT = 6


def weight(nodes: list[Node]) -> int:
    return sum(1 if not n.children else weight(n.children) for n in nodes)


def opened(node: Node) -> list[Node]:
    """A long bracket as what stands in it, so that a line may end within."""
    if not node.fenced or weight([node]) <= 3 * SHORT:
        return [node]
    first, *inner, last = node.children
    fixed = [mo(first.text, ' stretchy="false" form="prefix"'), *inner, mo(last.text, ' stretchy="false" form="postfix"')]
    fixed[0].spaced = node.spaced
    return fixed


def pieces(nodes: list[Node]) -> list[list[Node]]:
    """A long row in parts that a line may end behind."""
    nodes = [part for node in nodes for part in opened(node)]
    out: list[list[Node]] = [[]]
    for n, node in enumerate(nodes):
        breaks = node.kind == "mo" and node.text in BREAKS and n > 0
        comma = node.text in ",;"
        after = n > 0 and nodes[n - 1].kind == "mo" and nodes[n - 1].text in ",;"
        if (breaks and not comma and weight(out[-1]) >= SHORT and not ends_term(nodes[n - 1])) or (
            after and weight(out[-1]) >= SHORT
        ):
            if not after:
                node.attributes = ' form="infix"'
            out.append([])
        out[-1].append(node)
    return out


def typeset(text: str) -> str:
    """A formula as inline MathML, safe to stand in Markdown."""
    rows = pieces(Reader(text).row())
    spoken = html.escape(text, quote=True)
    out = []
    for n, row in enumerate(rows):
        inner = row_mathml(row)
        label = f' alttext="{spoken}"' if n == 0 else ""
        out.append(f"<math{label}><mrow>{inner}</mrow></math>")
    joined = "<wbr>".join(out)
    # Markdown must find nothing in it.
    joined = re.sub(r"(?<=>)[^<]+(?=<)|(?<=alttext=\")[^\"]*(?=\")", lambda m: safe(m[0]), joined)
    return f'<span class="formula">{joined}</span>'


def safe(text: str) -> str:
    return re.sub(r"&#?\w+;|[\\`*_{}\[\]()#+!|~^=:]", lambda m: m[0] if len(m[0]) > 1 else f"&#{ord(m[0])};", text)


NAME = re.compile(r"[a-z]{3,}(?:_[a-zA-Z0-9]+)+|[a-z]{4,}|k[A-Z]\w+|joint_24v|.*(?:make|dqwatch) .*|\w+/|\([EP]….*")
FORMULA_WORDS = {"draws", "target"}


def is_code(span: str) -> bool:
    """A name of the program, not a formula."""
    return bool(NAME.fullmatch(span)) and span not in FORMULA_WORDS


SUBSCRIPTED = re.compile(
    rf"(?<![\w`/.&#-])Δ?{L}[\u0300-\u036f]?'?_(?:\{{[^}}]*\}}|(?:{L}|\d){{1,6}}(?:,[ik](?!\w))?)[²³⁴]?(?![\w/`(=])")


def typeset_page(text: str) -> str:
    """docs/EQUATIONS.md with every formula typeset, and single symbols in its sentences."""
    out = []
    for part in re.split(r"(`[^`\n]+(?:\n[^`\n]+)?`)", text):
        if part.startswith("`") and part.endswith("`") and len(part) > 2:
            span = part[1:-1]
            out.append(part if is_code(span) else typeset(span))
        else:
            out.append(SUBSCRIPTED.sub(lambda m: typeset(m[0]), part))
    return "".join(out)


def flat(element: ElementTree.Element) -> str:
    """MathML as a line of text again."""
    parts = [flat(child) for child in element]
    own = element.text or ""
    if element.tag == "mo" and element.get("data-mark"):
        return "_"
    if element.tag == "mfrac":
        return f"{parts[0]}/{parts[1]}"
    if element.tag == "msqrt":
        return "√" + "".join(parts)
    if element.tag in ("msub", "munder"):
        return f"{parts[0]}_{parts[1]}"
    if element.tag == "msup":
        return f"{parts[0]}^{parts[1]}"
    if element.tag in ("msubsup", "munderover"):
        return f"{parts[0]}_{parts[1]}^{parts[2]}"
    return own + "".join(parts)


PLAIN = str.maketrans({
    **{k: "" for k in " \n()[]{}"}, "-": "−", "Σ": "∑", "'": "′", "*": "∗", **ACCENTS})


def signs(text: str) -> str:
    """What a formula is made of, in order, whatever brackets and spaces there are."""
    text = unicodedata.normalize("NFD", text)
    text = re.sub(r"(\d)e(-?)(\d)", lambda m: f"{m[1]}·10^{m[2]}{m[3]}", text)
    text = re.sub(f"[{''.join(SUPER)}]+", lambda m: "^" + "".join(SUPER[c] for c in m[0]), text)
    text = re.sub(f"[{''.join(SUB)}]+", lambda m: "_" + "".join(SUB[c] for c in m[0]), text)
    text = re.sub("[½¼¾⅓⅔]", lambda m: unicodedata.normalize("NFKD", m[0]).replace("⁄", "/"), text)
    for name, letter_ in GREEK.items():
        text = text.replace(name, letter_)
    text = text.translate(PLAIN).replace("^′", "′").replace("^∗", "∗").replace("′^", "′")
    return re.sub(r"(′+)(_[\w−+])", r"\2\1", text)


def mistakes(text: str) -> list[str]:
    """Formulas of the registry that cannot be typeset, or that are not what stands there."""
    wrong = []
    for match in re.finditer(r"`([^`]+)`", text):
        span = match[1]
        if is_code(span):
            continue
        line = text.count("\n", 0, match.start()) + 1
        try:
            made = typeset(span)
        except ValueError as error:
            wrong.append(f"docs/EQUATIONS.md:{line}: {error}")
            continue
        again = signs(flat(ElementTree.fromstring(made.replace("<wbr>", ""))))
        if again != signs(re.sub(rf"(?<![\w_])({L})(\d)", r"\1_\2", span)):
            wrong.append(f"docs/EQUATIONS.md:{line}: `{span}` is typeset as {again}")
    return wrong
