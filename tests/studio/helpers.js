// What the tests do inside the page.
window.helpers = {
  choose(selector, value) {
    const list = document.querySelector(selector);
    list.value = value;
    list.dispatchEvent(new Event("change"));
  },

  type(selector, value) {
    const box = document.querySelector(selector);
    box.value = value;
    box.dispatchEvent(new Event("input"));
  },

  enter(selector, value) {
    const box = document.querySelector(selector);
    box.value = value;
    box.dispatchEvent(new Event("change"));
  },

  /** Count the colours of a view's canvases; an empty one has one. */
  inked(view) {
    const colours = new Set();
    for (const canvas of document.querySelectorAll(`.view-${view} canvas`)) {
      if (!canvas.width) continue;
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      for (let k = 0; k < data.length; k += 4) colours.add(`${data[k]},${data[k + 1]},${data[k + 2]},${data[k + 3]}`);
    }
    return colours.size;
  },

  /** Return the texts of a picture, and the heights of its lines, px. */
  painted(view, width, height) {
    const [texts, heights] = [[], []];
    const note = (name) => (...all) => {
      if (name === "fillText") texts.push(all[0]);
      if (/^(move|line)To$/.test(name)) heights.push(all[1]);
      return { width: 10 };
    };
    window.studio.studio.views[view].paint(new Proxy({}, { get: (_pen, name) => note(name), set: () => true }), width, height);
    return { texts, heights };
  },

  drop(name, text) {
    const files = new DataTransfer();
    files.items.add(new File([text], name));
    const event = new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true });
    document.querySelector(".studio").dispatchEvent(event);
  },

  /** Choose an export; its text comes to lie in window.kept, and nothing is saved. */
  save(selector, value) {
    window.kept = null;
    URL.createObjectURL = (blob) => {
      blob.text().then((text) => { window.kept = text; });
      return "#";
    };
    HTMLAnchorElement.prototype.click = () => {};
    this.choose(selector, value);
  },

  /** Return what is cut, overlaps or lies outside, of the elements that are seen. */
  misfits() {
    const found = [];
    const ratio = devicePixelRatio;
    const box = (element) => element.getBoundingClientRect();
    const seen = (element) => element.checkVisibility() && box(element).width > 0;
    const name = (element) => `${element.tagName.toLowerCase()}.${element.className} ${(element.ariaLabel ?? element.textContent ?? "").slice(0, 30)}`;
    if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} wide of ${innerWidth}`);
    for (const canvas of document.querySelectorAll("canvas")) {
      if (!seen(canvas)) continue;
      const { width, height } = box(canvas);
      const holder = box(canvas.closest(".body, .pulse"));
      if (Math.abs(canvas.width - width * ratio) > 1.5 || Math.abs(canvas.height - height * ratio) > 1.5) found.push(`${name(canvas.closest("section, .pulse"))} is drawn ${canvas.width} x ${canvas.height} on ${width * ratio} x ${height * ratio}`);
      if (box(canvas).right > holder.right + 1 || box(canvas).bottom > holder.bottom + 1) found.push(`${name(canvas.closest("section, .pulse"))} is cropped`);
    }
    const words = [...document.querySelectorAll(".studio button, .studio h1, .studio h2 span, .studio label, .studio .caption, .studio .notice, .studio .unit, .studio .end, .studio summary, .studio .honesty, .studio .status")].filter(seen);
    for (const element of words) if (element.scrollWidth > element.clientWidth + 1 && element.clientWidth) found.push(`${name(element)} is cut`);
    const apart = (elements) => {
      elements.forEach((one, k) => {
        for (const other of elements.slice(k + 1)) {
          const [a, b] = [box(one), box(other)];
          if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) found.push(`${name(one)} lies over ${name(other)}`);
        }
      });
    };
    for (const parent of document.querySelectorAll(".studio .bar, .studio .strip, .studio .row, .studio .reach, .studio h2, .studio .transport, .studio .stage, .studio .notice")) apart([...parent.children].filter(seen));
    apart([...document.querySelectorAll(".studio .panel")].filter(seen));
    return found;
  },

  /** Return the texts that the views draw outside their canvas, or one over another. */
  async drawn() {
    const found = [];
    const { clearRect, fillText } = CanvasRenderingContext2D.prototype;
    // A picture that is drawn once more counts once.
    CanvasRenderingContext2D.prototype.clearRect = function forget(...all) {
      texts = texts.filter(({ canvas }) => canvas !== this.canvas);
      return clearRect.apply(this, all);
    };
    let texts = [];
    CanvasRenderingContext2D.prototype.fillText = function note(text, x, y, ...rest) {
      const size = this.measureText(text);
      const at = this.getTransform();
      const corners = [[-size.actualBoundingBoxLeft, -size.actualBoundingBoxAscent], [size.actualBoundingBoxRight, size.actualBoundingBoxDescent]];
      const ends = corners.map(([dx, dy]) => at.transformPoint({ x: x + dx, y: y + dy }));
      const [xs, ys] = [ends.map((end) => end.x), ends.map((end) => end.y)];
      texts.push({ text, left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys), canvas: this.canvas });
      return fillText.call(this, text, x, y, ...rest);
    };
    const { studio } = window.studio;
    for (const view of studio.store.state.views) {
      texts = [];
      studio.views[view].draw();
      // Curves are drawn a little later.
      await new Promise((done) => { setTimeout(done, 5); });
      texts = texts.filter(({ text }) => String(text).trim());
      for (const { text, left, right, top, bottom, canvas } of texts) if (left < -1 || top < -1 || right > canvas.width + 1 || bottom > canvas.height + 1) found.push(`${view}: “${text}” is cut`);
      texts.forEach((one, k) => {
        for (const other of texts.slice(k + 1)) {
          if (one.canvas === other.canvas && Math.min(one.right, other.right) - Math.max(one.left, other.left) > 2 && Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top) > 2) found.push(`${view}: “${one.text}” lies over “${other.text}”`);
        }
      });
    }
    Object.assign(CanvasRenderingContext2D.prototype, { clearRect, fillText });
    return found;
  },
};
