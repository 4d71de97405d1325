// The field of the pose: shows where the platform is, unless somebody types in it.
(() => {
  const ID = "sagline-pose";
  let present = "";
  let typing = false;
  let touched = false;

  const field = () => document.getElementById(ID);
  let refusal = "";
  const show = () => {
    const input = field();
    const told = document.getElementById("sagline-pose-reply");
    if (told && told.textContent !== refusal) told.textContent = refusal;
    if (input && !typing && input.value !== present) input.value = present;
  };
  const say = (refused) => {
    refusal = refused;
    field()?.setAttribute("aria-invalid", String(Boolean(refused)));
    show();
  };
  const go = (input) => {
    touched = false;
    window.sagline.ask("pose", input.value, ({ refused }) => {
      say(refused ?? "");
      if (!refused && !touched) typing = false; // what has been typed since then stays
      show();
    });
  };
  const stop = () => {
    typing = touched = false;
    say("");
    show();
  };

  window.sagline.refuse = say; // what else of the state cannot be had
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
