// The page in a frame of a notebook, for anywidget.
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "printhammer studio";
    // The page begins with the state that is the name of its window.
    frame.name = model.get("state");
    frame.srcdoc = model.get("page");
    frame.style.cssText = "width: 100%; border: 0";
    frame.style.height = model.get("height");
    let told = frame.name;
    const hear = ({ source, data }) => {
      if (source !== frame.contentWindow || typeof data?.printhammer !== "string") return;
      told = data.printhammer;
      model.set("state", told);
      model.save_changes();
    };
    const tell = () => {
      if (model.get("state") === told) return;
      frame.contentWindow?.postMessage({ printhammer: model.get("state") }, "*");
    };
    window.addEventListener("message", hear);
    model.on("change:state", tell);
    el.append(frame);
    return () => { window.removeEventListener("message", hear); model.off("change:state", tell); };
  },
};
