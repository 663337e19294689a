// The studio as a page of its own: one socket, the state in the address.
import { mount } from "./mount.js";

const token = new URLSearchParams(location.search).get("token") ?? "";
let socket = null;
let waiting = [];

const studio = mount(document.getElementById("studio"), (text) => {
  if (socket?.readyState === WebSocket.OPEN) socket.send(text);
  else waiting.push(text);
}, {
  read: () => location.hash.slice(1),
  write: (text) => history.replaceState(null, "", `${location.pathname}${location.search}#${text}`),
  address: () => location.href,
});
window.studio = studio;
window.addEventListener("hashchange", () => studio.open(location.hash.slice(1)));

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    for (const text of waiting) socket.send(text);
    waiting = [];
    studio.connected();
  };
  socket.onmessage = (event) => studio.receive(event.data);
  socket.onclose = (event) => studio.lost(event.reason, connect);
}
// So that the keys work from the start.
studio.studio.parts.grid.focus({ preventScroll: true });
connect();
