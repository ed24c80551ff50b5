// Filters of the list of episodes, such as "slips>0 and time<6", "reason:slip not policy=expert" or "seed=7 or note:odd". A
// filter is parsed into a function of a row. This file does not use the page.
"use strict";

// Fields with numbers, by name. A row without a value matches no comparison. `time` (of the end), `success_time` and
// `moment` are in seconds.
Evalbus.FILTER_NUMBERS = {
  time: (row) => row.time_s, success_time: (row) => (row.success ? row.time_s : null), moment: (row) => row.cause_time_s,
  slips: (row) => row.slips, grasps: (row) => row.grasps, collisions: (row) => row.collisions, stages: (row) => row.stages, seed: (row) => row.seed, episode: (row) => row.episode,
};
Evalbus.FILTER_TEXTS = {
  policy: (row) => row.policy, task: (row) => `${row.task}/${row.variation}`,
  result: (row) => Evalbus.resultOf(row),
  reason: (row) => row.failure_reason || (row.success ? "" : row.end_reason), note: (row) => row.note,
  text: (row) => row.cause_text || row.text,
};

// Error thrown by parseFilter. `at` is the index of the character in the text.
Evalbus.FilterError = class extends Error {
  constructor(at, message) {
    super(`character ${at + 1}: ${message}`);
    this.at = at;
  }
};

// Normalizes a text for comparisons, which ignore case, quotation marks (a filter cannot contain them, see filterValue), and
// the difference between "_" and " ".
Evalbus.plainText = (text) => String(text === null || text === undefined ? "" : text).toLowerCase().replace(/_/g, " ").replace(/"/g, "");

Evalbus.filterTokens = (text) => {
  const pattern = /\s*(?:(\()|(\))|(<=|>=|!=|[<>=:])|"([^"]*)"|([^\s()<>=:!"]+))/y;
  const tokens = [];
  while (text.slice(pattern.lastIndex).trim() !== "") {
    const from = pattern.lastIndex;
    const match = pattern.exec(text);
    const at = from + /^\s*/.exec(text.slice(from))[0].length;
    if (!match) {
      throw new Evalbus.FilterError(at, text[at] === "\"" ? "the quotation mark is not closed" : `"${text[at]}" is not expected here`);
    }
    const [, open, close, operator, quoted, word] = match;
    tokens.push(open || close ? { kind: open || close, at } : operator ? { kind: "operator", text: operator, at }
      : quoted !== undefined ? { kind: "text", text: quoted, at } : { kind: "word", text: word, at });
  }
  return tokens;
};

// Parses terms joined by "and" (which may be omitted) and "or", with "not" and parentheses. A term is FIELD OPERATOR VALUE, or
// a word or quoted text, which accepts rows with a text that contains it. Returns a function of a row; throws FilterError.
Evalbus.parseFilter = (text) => {
  const tokens = Evalbus.filterTokens(text);
  let next = 0;
  const isWord = (word) => next < tokens.length && tokens[next].kind === "word" && tokens[next].text.toLowerCase() === word;
  const either = () => {
    const parts = [all()];
    while (isWord("or")) {
      ++next;
      parts.push(all());
    }
    return parts.length === 1 ? parts[0] : (row) => parts.some((part) => part(row));
  };
  const all = () => {
    const parts = [term()];
    while (next < tokens.length && tokens[next].kind !== ")" && !isWord("or")) {
      if (isWord("and")) ++next;
      parts.push(term());
    }
    return parts.length === 1 ? parts[0] : (row) => parts.every((part) => part(row));
  };
  const term = () => {
    if (next >= tokens.length || isWord("and") || isWord("or") || ["operator", ")"].includes(tokens[next].kind)) {
      const token = tokens[next];
      throw new Evalbus.FilterError(token ? token.at : text.length, "expected a condition, for example slips>0 or reason:slip");
    }
    if (isWord("not")) {
      ++next;
      const part = term();
      return (row) => !part(row);
    }
    const token = tokens[next++];
    if (token.kind === "(") {
      const part = either();
      if (next >= tokens.length) throw new Evalbus.FilterError(token.at, "the parenthesis is not closed");
      ++next;
      return part;
    }
    const operator = tokens[next];
    if (token.kind !== "word" || !operator || operator.kind !== "operator") return Evalbus.containsText(token.text);
    const value = tokens[++next];
    if (!value || !["word", "text"].includes(value.kind)) {
      throw new Evalbus.FilterError(value ? value.at : text.length, `expected a value after ${token.text}${operator.text}`);
    }
    ++next;
    return Evalbus.filterTerm(token, operator, value);
  };
  if (!tokens.length) return () => true;
  const filter = either();
  if (next < tokens.length) throw new Evalbus.FilterError(tokens[next].at, "there is no parenthesis to close");
  return filter;
};

// Returns the texts with which a text field of a row is compared: its value and, for a reason, the words that are shown for
// it.
Evalbus.plainTexts = (key, row) => {
  const text = Evalbus.FILTER_TEXTS[key](row);
  return (key === "reason" ? [text, Evalbus.reasonText(text)] : [text]).map(Evalbus.plainText);
};

Evalbus.containsText = (text) => {
  const wanted = Evalbus.plainText(text);
  const keys = Object.keys(Evalbus.FILTER_TEXTS);
  return (row) => keys.some((key) => Evalbus.plainTexts(key, row).some((one) => one.includes(wanted)));
};

Evalbus.filterTerm = (name, operator, value) => {
  const key = name.text.toLowerCase();
  const number = Object.hasOwn(Evalbus.FILTER_NUMBERS, key) && Evalbus.FILTER_NUMBERS[key];
  if (number) {
    const limit = Number(value.text);
    if (value.text.trim() === "" || Number.isNaN(limit)) {
      throw new Evalbus.FilterError(value.at, `${key} is a number; "${value.text}" is not`);
    }
    const compare = { "<": (a) => a < limit, ">": (a) => a > limit, "<=": (a) => a <= limit, ">=": (a) => a >= limit,
      "=": (a) => a === limit, ":": (a) => a === limit, "!=": (a) => a !== limit }[operator.text];
    return (row) => Number.isFinite(number(row)) && compare(number(row));
  }
  if (!Object.hasOwn(Evalbus.FILTER_TEXTS, key)) {
    const known = [...Object.keys(Evalbus.FILTER_NUMBERS), ...Object.keys(Evalbus.FILTER_TEXTS)].join(", ");
    throw new Evalbus.FilterError(name.at, `"${name.text}" is not a field; the fields are ${known}`);
  }
  const wanted = Evalbus.plainText(value.text);
  const compare = { ":": (texts) => texts.some((text) => text.includes(wanted)), "=": (texts) => texts.includes(wanted),
    "!=": (texts) => !texts.includes(wanted) }[operator.text];
  if (!compare) throw new Evalbus.FilterError(operator.at, `${key} is a text; use : (contains), = or !=`);
  return (row) => compare(Evalbus.plainTexts(key, row));
};

// Returns a value in quotes, as in a term of a filter. Quotes within the value are removed.
Evalbus.filterValue = (text) => `"${String(text).replace(/"/g, "")}"`;
