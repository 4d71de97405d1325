// window.sagline: what the page says to the server beside viser's own words, and hears from it (channel.py).
(() => {
  const say = (lost) => {
    let banner = document.getElementById("sagline-lost");
    if (!banner && lost) {
      banner = document.createElement("div");
      banner.id = "sagline-lost";
      banner.setAttribute("role", "alert");
      banner.textContent = "Disconnected. Is sagline view still running? The page reconnects by itself.";
      document.body.append(banner);
    }
    if (banner) banner.hidden = !lost;
  };

  const handlers = new Map(); // of topics
  const told = new Map(); // the last value of each topic: who asks later hears it at once
  const topics = new Map(); // by the uuid of the element that brings them
  const unsent = new Map(); // by topic: the last of what is not told yet
  let count = 0;
  let worker, uuid; // the client speaks to its server through a worker; uuid of the field that says what we say

  let welcome = false; // whether the server hears us: it does not before it knows where our camera is

  const post = (value) =>
    worker.postMessage({ type: "send", message: { type: "GuiUpdateMessage", uuid, updates: { value } } });
  const flush = () => {
    if (!welcome || uuid === undefined) return;
    unsent.forEach(post);
    unsent.clear();
  };
  const tell = (topic, value) => {
    told.set(topic, value);
    for (const each of handlers.get(topic) ?? []) each(value);
  };

  window.sagline = {
    // Tell the server something; what is told last before the connection stands is told then.
    send(topic, value) {
      const text = JSON.stringify({ topic, value, count: (count += 1) }); // the same twice is said twice
      unsent.delete(topic); // topics go in the order in which they were told
      unsent.set(topic, text);
      flush();
    },
    // Hear what the server tells about a topic, the last that it has told first.
    on(topic, handler) {
      handlers.set(topic, [...(handlers.get(topic) ?? []), handler]);
      if (told.has(topic)) handler(told.get(topic));
    },
  };

  const hear = (message) => {
    if (message.type === "GuiTextMessage" && message.props.label === "sagline") {
      uuid = message.uuid;
      flush();
    } else if (message.type === "GuiHtmlMessage" && message.props.content.startsWith("sagline:")) {
      topics.set(message.uuid, message.props.content.split(":", 2)[1]);
      content(message.uuid, message.props.content);
    } else if (message.type === "GuiUpdateMessage" && topics.has(message.uuid) && "content" in message.updates) {
      content(message.uuid, message.updates.content);
    }
  };
  const content = (from, text) => {
    const topic = topics.get(from);
    const json = text.slice(`sagline:${topic}:`.length);
    if (json) tell(topic, JSON.parse(json));
  };

  window.sagline.on("welcome", () => {
    welcome = true;
    flush();
  });

  let waiting = 0;
  window.Worker = class extends window.Worker {
    constructor(...parts) {
      super(...parts);
      worker = this;
      this.addEventListener("message", ({ data }) => {
        if (data?.type === "connected") {
          clearTimeout(waiting);
          waiting = 0;
          say(false);
          tell("connected", true);
        } else if (data?.type === "closed") {
          uuid = undefined; // a server that comes back has another field
          welcome = false;
          tell("connected", false);
          waiting ||= setTimeout(() => say(true), 1500); // a reload or a short break needs no words
        } else if (data?.type === "message_batch") {
          data.messages.forEach(hear);
        }
      });
    }
  };
})();
