// Things of ours that viser's client has not drawn before: sagline.dress(work) works whenever the page has changed.
(() => {
  const works = [];
  let due = false;
  const all = () => {
    due = false;
    for (const work of works) work();
  };
  const soon = () => {
    if (!due) requestAnimationFrame(all);
    due = true;
  };
  window.sagline.dress = (work) => {
    works.push(work);
    soon();
  };
  new MutationObserver(soon).observe(document, { subtree: true, childList: true });

  // Ask the server something that it answers under "topic-told", this page alone.
  let count = 0;
  const page = Math.random().toString(36).slice(2);
  window.sagline.ask = (topic, text, answered) => {
    const name = `${page}-${(count += 1)}`;
    waiting.set(name, answered);
    if (!heard.has(topic)) {
      heard.add(topic);
      window.sagline.on(`${topic}-reply`, ({ to, ...answer }) => {
        waiting.get(to)?.(answer);
        waiting.delete(to);
      });
    }
    window.sagline.send(topic, [name, text]);
  };
  const waiting = new Map(); // who wants to know, by the names of the questions
  const heard = new Set(); // topics
})();
