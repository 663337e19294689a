// Views that do not belong to what is set now: the class `outdated`, and in `data-why` the reason.
const LATE = 250; // ms that a view may be behind before that is worth a mark

const CURVES = ["motion", "sketch", "forces", "phase", "loops"];
const OWN = ["map", "line", "strobe"];
const OF_FRAMES = { dots: ["energy"], map: ["map"], line: ["line"], strobe: ["strobe"] };

/** Marks for views, each an element that `panel` finds by its name. */
export function marksFor(panel) {
  const reasons = new Map();
  const timers = new Map();
  const show = (view) => {
    clearTimeout(timers.get(view));
    timers.delete(view);
    panel(view).classList.add("outdated");
    panel(view).dataset.why = reasons.get(view);
  };

  function mark(views, why, wait = LATE) {
    for (const view of views) {
      reasons.set(view, why);
      if (wait <= 0 || panel(view).classList.contains("outdated")) show(view);
      else if (!timers.has(view)) timers.set(view, setTimeout(() => show(view), wait));
    }
  }
  function clear(views) {
    for (const view of views) {
      clearTimeout(timers.get(view));
      timers.delete(view);
      reasons.delete(view);
      panel(view).classList.remove("outdated");
      delete panel(view).dataset.why;
    }
  }
  const ALL = [...CURVES, "energy", ...OWN];
  let refused = 0;
  let latest = 0; // the number of the newest state that was sent

  return {
    /** A state is on its way that was set at a time; it may have waited for the one before. */
    sent: (serial, set) => {
      latest = serial;
      mark(ALL, "being computed for what is set now", LATE - (performance.now() - set));
    },
    /** Nothing is computed, and why; what still comes of states up to a number is outdated too. */
    none(why, serial = 0) {
      refused = serial;
      mark(ALL, why, 0);
    },
    /** A frame has come. */
    arrived(frame) {
      // Dots follow their curves, while a newer state may be on its way.
      if (frame.serial <= refused || (frame.kind === "dots" && frame.serial < latest)) return;
      if (frame.kind !== "motion") { clear(OF_FRAMES[frame.kind] ?? []); return; }
      clear(CURVES);
      for (const view of OWN) {
        if (view in frame.outdated) mark([view], frame.outdated[view]);
        else clear([view]);
      }
    },
  };
}
