"""Marks of outdated views, a quarter of a second after a change of the settings."""

from pathlib import Path

from tests.studio.reading import evaluated

MARKS = """
const { marksFor } = await import("./marks.js");
const panels = {};
const panelOf = () => {
  const names = new Set();
  const classList = { add: (name) => names.add(name), remove: (name) => names.delete(name),
    contains: (name) => names.has(name) };
  return { classList, dataset: {} };
};
const marks = marksFor((name) => (panels[name] ??= panelOf()));
const isMarked = () => panels.motion.classList.contains("outdated");
const later = (wait) => new Promise((done) => setTimeout(done, wait));
const motion = (serial) => ({ kind: "motion", serial, outdated: {} });
const seen = [];
const begun = performance.now();
marks.sent(1, begun);
seen.push(isMarked());
await later(300);
seen.push(isMarked());
// The first run arrives; the state that has waited for it since its beginning is sent.
marks.arrived(motion(1));
marks.sent(2, begun + 20);
seen.push(isMarked());
marks.arrived(motion(2));
seen.push(isMarked());
// A state that was set just now.
marks.sent(3, performance.now());
seen.push(isMarked());
marks.none("refused", 3);
seen.push(isMarked());
console.log(JSON.stringify(seen));
"""


def test_a_state_that_has_waited_is_marked_at_once(modules: Path) -> None:
    assert evaluated(modules, MARKS) == [False, True, True, False, False, True]
