"""Lists what a C++ file defines at namespace scope, by qualified name: the types and functions that other files see, or
what it keeps to itself: what its unnamed namespaces hold, static functions, constants and variables.

A reader of tokens, not a compiler: it follows braces, and skips bodies, comments and preprocessor lines.
"""
import re
from dataclasses import dataclass, replace

NOISE = re.compile(r"""
    //(?:\\\n|[^\n])* | /\*.*?\*/                       # comments
  | ^[ \t]*\#(?:\\\n|[^\n])*                            # preprocessor lines
  | R"(?P<end>[^(\s]*)\(.*?\)(?P=end)"                  # raw strings
  | "(?:\\.|[^"\\\n])*" | (?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'""", re.X | re.S | re.M)
TOKEN = re.compile(r"[A-Za-z_]\w*|::|->|&&|\|\||[0-9][\w.']*|[^\s\w]")
IDENTIFIER = re.compile(r"[A-Za-z_]\w*$")
QUALIFIED = re.compile(r"[A-Za-z_]\w*(::[A-Za-z_]\w*)*$")
TYPE_WORDS = ("struct", "class", "union", "enum")
GTEST_MACROS = ("TEST", "TEST_F", "TEST_P", "TYPED_TEST", "RC_GTEST_PROP")
BEFORE_TYPE = ("typedef", "static", "inline", "constexpr", "const", "friend")
CLOSING = {"(": ")", "[": "]", "{": "}"}
UNNAMED = "(unnamed)"  # stands for an unnamed namespace in a scope
NO_VARIABLE = ("using", "typedef", "static_assert", "extern", "friend", "namespace", *TYPE_WORDS)  # what these begin
# What may stand last in the type of an unnamed parameter.
TYPE_ENDINGS = {"int", "double", "float", "bool", "char", "long", "short", "unsigned", "auto", "const", "void"}


@dataclass(frozen=True)
class Definition:
    kind: str  # type, alias, function or variable
    name: str  # qualified; of functions with the types of their parameters
    text: str  # what an alias stands for; two that stand for the same may agree
    line: int


def tokens_of(text):
    """(token, line) of everything that is no comment, string or preprocessor line."""
    def blank(match):
        return '""' + "\n" * match[0].count("\n") if match[0][0] in "\"R'" else "\n" * match[0].count("\n") + " "
    clean = NOISE.sub(blank, text)
    line, at, result = 1, 0, []
    for match in TOKEN.finditer(clean):
        line += clean.count("\n", at, match.start())
        at = match.start()
        result.append((match[0], line))
    return result


def matching(tokens, start):
    """Index of the bracket that closes the one at `start`."""
    opening, closing, depth = tokens[start][0], CLOSING[tokens[start][0]], 0
    for i in range(start, len(tokens)):
        depth += (tokens[i][0] == opening) - (tokens[i][0] == closing)
        if depth == 0:
            return i
    return len(tokens) - 1


def skip_angles(words, start):
    """Index after the template arguments that start at `start` with '<'."""
    depth, i = 0, start
    while i < len(words):
        if words[i] in "([{":
            i = matching([(word, 0) for word in words], i)
        else:
            depth += (words[i] == "<") - (words[i] == ">")
        i += 1
        if depth == 0:
            break
    return i


def without_prefix(words):
    """The words of a declaration without `template <...>`, attributes and alignas."""
    i = 0
    while i < len(words):
        if words[i] == "template" and i + 1 < len(words) and words[i + 1] == "<":
            i = skip_angles(words, i + 1)
        elif words[i] == "[" and words[i + 1:i + 2] == ["["]:
            i = matching([(word, 0) for word in words], i) + 1
        elif words[i] in ("alignas", "__attribute__") and words[i + 1:i + 2] == ["("]:
            i = matching([(word, 0) for word in words], i + 1) + 1
        elif words[i] in BEFORE_TYPE:
            i += 1
        else:
            break
    return words[i:]


def type_name(words):
    """Name of the type that a declaration defines, or None."""
    words = without_prefix(words)
    if not words or words[0] not in TYPE_WORDS:
        return None
    words = without_prefix(words[1:])
    if words and words[0] in TYPE_WORDS:  # enum class
        words = words[1:]
    name, i = "", 0
    while i < len(words) and (IDENTIFIER.match(words[i]) or words[i] == "::") and words[i] != "final":
        name += words[i]
        i += 1
        if i < len(words) and words[i] == "<":
            end = skip_angles(words, i)
            name += "".join(words[i:end])
            i = end
    rest = words[i:]
    return name if name and (not rest or rest[0] in (":", "final")) else None


def parameter_type(words):
    """A parameter without its name and default."""
    if "=" in words:
        words = words[:words.index("=")]
    types = [word for word in words if IDENTIFIER.match(word) and word not in ("const", "volatile")]
    if len(types) > 1 and words and IDENTIFIER.match(words[-1]) and words[-1] not in TYPE_ENDINGS \
            and words[-2] != "::":
        words = words[:-1]
    return " ".join(words)


def split_parameters(words):
    parts, part, i = [], [], 0
    while i < len(words):
        end = i + 1
        if words[i] in "([{":
            end = matching([(word, 0) for word in words], i) + 1
        elif words[i] == "<":
            end = skip_angles(words, i)
        if words[i] == ",":
            parts.append(part)
            part = []
        else:
            part += words[i:end]
        i = end
    return [parameter_type(p) for p in (*parts, part) if p]


def function_name(words):
    """Name and parameter types of the function that a declaration defines, or None."""
    template = words[:skip_angles(words, 1)] if words[:2] == ["template", "<"] else []
    words = words[len(template):]
    start = words.index("operator") if "operator" in words else 0
    opening = next((i for i in range(start + 1, len(words)) if words[i] == "(" and words[i - 1] not in
                    ("decltype", "alignas", "noexcept", "requires", "operator", "__attribute__", "(")), None)
    if opening is None or (start == 0 and not IDENTIFIER.match(words[opening - 1]) and words[opening - 1] != ">"):
        return None
    closing = matching([(word, 0) for word in words], opening)
    first = start if start else opening - 1
    while first > 0 and words[first - 1] == "::":
        first -= 2
        if words[first] == ">":  # the arguments of a class template
            while first > 0 and words[first] != "<":
                first -= 1
            first -= 1
    if "=" in words[:first]:
        return None  # a variable
    qualifiers = [word for word in words[closing + 1:] if word in ("const", "&", "&&")][:2]
    return "".join(words[first:opening]) + f"({', '.join(split_parameters(words[opening + 1:closing]))})" + \
        " ".join(["", *qualifiers]) + (f" [{' '.join(template)}]" if template else "")


def variable_names(words):
    """Names of the variables that a declaration (up to its semicolon) defines. One with its arguments in parentheses
    looks like the declaration of a function: it is a variable if its name is that of a constant."""
    words = without_prefix(words)
    if not words or words[0] in NO_VARIABLE or "operator" in words:
        return []
    names, before, in_value, i = [], "", False, 0
    while i < len(words):
        word, after = words[i], i + 1
        ends_name = not in_value and QUALIFIED.match(before)
        if word == "<" and (not in_value or QUALIFIED.match(before)):
            after = skip_angles(words, i)
        elif word in CLOSING:
            after = matching([(each, 0) for each in words], i) + 1
            if ends_name and (word != "(" or re.match("k[A-Z]", before)):
                names.append(before)
            in_value = True
        elif word in ("=", ","):
            names += [before] if ends_name else []
            in_value = word == "="
        before = before + word if word == "::" or before.endswith("::") else words[after - 1]
        i = after
    return names + ([before] if not in_value and len(words) > 1 and QUALIFIED.match(before) else [])


class Reader:
    """Follows one file's scopes."""

    def __init__(self, text, unnamed=False):
        self.tokens = tokens_of(text)
        self.unnamed = unnamed
        self.found = []

    def read(self):
        self.read_scope(0, [])
        return self.found

    def note(self, kind, scope, name, line, text=""):
        self.found.append(Definition(kind, "::".join([*scope, name]), text, line))

    def read_scope(self, at, scope):
        """Reads declarations up to the closing brace; the index after it."""
        start = at
        while at < len(self.tokens):
            token = self.tokens[at][0]
            if token == "}":
                return at + 1
            if token in "([":
                at = matching(self.tokens, at) + 1
            elif token == ";":
                self.read_alias(start, at, scope)
                self.read_variables(start, at, scope)
                at = start = at + 1
            elif token == "{":
                at, ended = self.read_braces(start, at, scope)
                start = at if ended else start
            else:
                at += 1
        return at

    def read_alias(self, start, end, scope):
        words = without_prefix([token for token, _ in self.tokens[start:end]])
        if words[:1] == ["using"] and words[2:3] == ["="]:
            self.note("alias", scope, words[1], self.tokens[start][1], " ".join(words[3:]))

    def read_variables(self, start, end, scope):
        if self.unnamed:
            for name in variable_names([token for token, _ in self.tokens[start:end]]):
                self.note("variable", [*scope, UNNAMED], name, self.tokens[start][1])

    def read_braces(self, start, at, scope):
        """What an opening brace begins: (index to go on at, whether the declaration ends there)."""
        words = [token for token, _ in self.tokens[start:at]]
        line = self.tokens[start][1]
        if "namespace" in words[:2]:
            names = [word for word in words if IDENTIFIER.match(word) and word not in ("namespace", "inline")]
            if not names and not self.unnamed:
                return matching(self.tokens, at) + 1, True
            return self.read_scope(at + 1, [*scope, *(names or [UNNAMED])]), True
        if words[:1] == ["extern"] and words[1:2] == ['"']:
            return self.read_scope(at + 1, scope), True
        after = matching(self.tokens, at) + 1
        if name := type_name(words):
            self.note("type", scope, name, line)
            return after, False  # up to the semicolon
        if words[:1] and words[0] in GTEST_MACROS:
            names = [word for word in words[1:] if IDENTIFIER.match(word)][:2]
            self.note("type", scope, "_".join(names) + "_Test", line)
            return after, True
        name = function_name(words)
        if not name:
            return after, False
        if self.in_initialisers(words):
            return after, False
        is_static = "static" in words[:words.index("(")]
        if self.unnamed or not is_static:
            self.note("function", [*scope, UNNAMED] if is_static else scope, name, line)
        return after, True

    @staticmethod
    def in_initialisers(words):
        """Whether a brace after these words initialises a member: Name::Name(...) : member{."""
        depth, initialisers = 0, False
        for before, word in zip(["", *words], words):
            depth += (word in "([") - (word in ")]")
            initialisers |= word == ":" and depth == 0 and before in (")", "noexcept")
        return initialisers and bool(IDENTIFIER.match(words[-1]) or words[-1] == ">")


def definitions(text):
    """What other files see: types, aliases and functions, but none that are static or in unnamed namespaces."""
    return Reader(text).read()


def unnamed_definitions(text):
    """What a source file keeps to itself: what stands in unnamed namespaces (which are left out of the names), static
    functions, and constants and variables."""
    found = [definition for definition in Reader(text, unnamed=True).read() if UNNAMED in definition.name.split("::")]
    return [replace(definition, name=definition.name.replace(UNNAMED + "::", "")) for definition in found]
