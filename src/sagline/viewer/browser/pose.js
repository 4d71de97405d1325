// Field of the pose: it shows the pose of the platform, unless the user is typing in it.
(() => {
  const ID = "sagline-pose";
  let present = "";
  let typing = false;
  let touched = false;

  const field = () => document.getElementById(ID);
  let refusal = "";
  const show = () => {
    const input = field();
    const reply = document.getElementById("sagline-pose-reply");
    if (reply && reply.textContent !== refusal) reply.textContent = refusal;
    if (input && !typing && input.value !== present) input.value = present;
  };
  const showRefusal = (refused) => {
    refusal = refused;
    field()?.setAttribute("aria-invalid", String(Boolean(refused)));
    show();
  };
  const go = (input) => {
    touched = false;
    window.sagline.ask("pose", input.value, ({ refused }) => {
      showRefusal(refused ?? "");
      if (!refused && !touched) typing = false; // keep text that was typed after the request
      show();
    });
  };
  const stop = () => {
    typing = touched = false;
    showRefusal("");
    show();
  };

  window.sagline.refuse = showRefusal; // also for links and copies
  window.sagline.on("pose", (text) => {
    present = text;
    show();
  });
  window.sagline.dress(show);
  document.addEventListener("focusin", ({ target }) => {
    if (target.id === ID) typing = true;
  });
  document.addEventListener("input", ({ target }) => {
    if (target.id === ID) typing = touched = true;
  });
  document.addEventListener("focusout", ({ target }) => {
    if (target.id !== ID) return;
    if (touched) go(target);
    else if (target.getAttribute("aria-invalid") !== "true") typing = false;
  });
  document.addEventListener("keydown", (event) => {
    if (event.target.id !== ID) return;
    if (event.key === "Enter") go(event.target);
    else if (event.key === "Escape") stop();
  });
})();
