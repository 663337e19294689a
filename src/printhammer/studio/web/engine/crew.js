// Workers: each has one order at a time; the next one waits here, and can still be dropped.

/** Start workers that run a script; `send` orders work of a role, and gives the frames or why there are none. */
export function crewOf(script, shelf) {
  const place = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
  const count = Math.min(Math.max(navigator.hardwareConcurrency || 2, 1), 8);
  let number = 0;
  const start = () => {
    const worker = new Worker(place);
    const own = { worker, known: new Set(), order: null };
    worker.postMessage({ limits: { ...shelf.limits, ...shelf.sentences } });
    worker.onmessage = ({ data }) => {
      const { order } = own;
      if (data.going || data.frame) {
        // On the way: a frame of what is done so far, or only a sign of life.
        order.onward(data);
        if (!order.wanted()) worker.postMessage({ drop: data.number });
        return;
      }
      own.order = null;
      order.done(data.frames === null ? null : data);
      next();
    };
    worker.onerror = (event) => fail(own, event.message);
    return own;
  };
  /** End the order of a worker that cannot compute it. */
  function fail(own, error) {
    const { order } = own;
    own.order = null;
    order?.done({ reason: `this could not be computed, ${error}` });
    next();
  }
  // Curves have a worker of their own: a map never delays them.
  const teams = { curves: { workers: [start()], orders: [] }, map: { workers: Array.from({ length: count }, start), orders: [] } };

  async function hand(own, order) {
    own.order = order;
    const { name, quantity } = order;
    const { kernel } = order.message;
    try {
      if (!own.known.has(kernel)) {
        const module = await shelf.module(name, quantity);
        own.worker.postMessage({ kernel, module, hammer: shelf.driven(name, quantity) });
        own.known.add(kernel);
      }
      own.worker.postMessage(order.message);
    } catch (error) {
      fail(own, error);
    }
  }
  function next() {
    for (const { workers, orders } of Object.values(teams)) {
      for (const own of workers) {
        if (own.order) continue;
        let order = orders.shift();
        while (order && !order.wanted()) {
          order.done(null);
          order = orders.shift();
        }
        if (order) hand(own, order);
      }
    }
  }
  return {
    count,
    /** Order a work; `done` gets { frames } or { reason }, or null where it is not wanted any more; `onward` what comes on the way. */
    send(team, work, state, more, wanted, done, onward = () => {}) {
      number += 1;
      const [name, quantity] = [state.hammer, shelf.quantity(state)];
      teams[team].orders.push({ name, quantity, message: { number, work, state, kernel: `${name}, ${quantity}`, ...more }, wanted, done, onward });
      next();
    },
  };
}
