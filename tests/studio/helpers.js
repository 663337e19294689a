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

  /** Hand a frame, as text of base64, to the widget. */
  take(text) {
    const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
    window.take({}, [new DataView(bytes.buffer)]);
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
};
