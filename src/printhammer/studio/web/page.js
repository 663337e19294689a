// The studio as a page of its own: one socket, the state in the address.
import { mount } from "./mount.js";

const TOKEN = "printhammer token";
const SOONEST = 500; // ms before another try to connect
const LATEST = 4000;

// Once seen, the token is kept by the browser for this address, and no longer in what can be copied or bookmarked.
const asked = new URLSearchParams(location.search).get("token");
if (asked) {
  localStorage.setItem(TOKEN, asked);
  history.replaceState(null, "", `${location.pathname}${location.hash}`);
}
const token = asked ?? localStorage.getItem(TOKEN) ?? "";
let socket = null;
let waiting = [];
let delay = SOONEST;
let timer = 0;

const studio = mount(document.getElementById("studio"), (text) => {
  if (socket?.readyState === WebSocket.OPEN) socket.send(text);
  else waiting.push(text);
}, {
  read: () => location.hash.slice(1),
  write: (text) => history.replaceState(null, "", `${location.pathname}#${text}`),
  address: () => location.href,
});
window.studio = studio;
window.addEventListener("hashchange", () => studio.open(location.hash.slice(1)));

function connect() {
  clearTimeout(timer);
  socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  let opened = false;
  socket.onopen = () => {
    opened = true;
    delay = SOONEST;
    for (const text of waiting) socket.send(text);
    waiting = [];
    studio.connected();
  };
  socket.onmessage = (event) => studio.receive(event.data);
  socket.onclose = async (event) => {
    // States that were not sent are outdated by the one that is sent when connected.
    waiting = waiting.filter((text) => !text.startsWith('{"kind":"state"'));
    let { reason } = event;
    if (!reason && !opened && await refused()) reason = "this page has no token, or an old one: open the address that the studio printed once, then links without it work";
    studio.lost(reason, connect);
    if (reason) return;
    timer = setTimeout(connect, delay);
    delay = Math.min(2 * delay, LATEST);
  };
}

/** Whether the studio is there and does not know the token. */
async function refused() {
  try {
    return (await fetch(`/?token=${encodeURIComponent(token)}`)).status === 403;
  } catch {
    return false;
  }
}
// So that the keys work from the start.
studio.studio.parts.grid.focus({ preventScroll: true });
connect();
