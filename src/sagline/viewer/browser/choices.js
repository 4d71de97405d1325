// Clicks on elements of lists and figures with data-send="topic" and data-value.
(() => {
  const choiceAt = (element) => element?.closest?.("[data-send]")?.dataset;
  const choose = ({ send, value }) => window.sagline.send(send, value);

  // A choice is a press and a release on the same element, because a list that is replaced in between gives no click event.
  let pressed;
  document.addEventListener("pointerdown", (event) => {
    pressed = event.button === 0 ? choiceAt(event.target) : undefined;
  });
  document.addEventListener("pointercancel", () => {
    pressed = undefined;
  });
  document.addEventListener("pointerup", (event) => {
    const released = choiceAt(document.elementFromPoint(event.clientX, event.clientY));
    if (pressed && released?.send === pressed.send && released.value === pressed.value) choose(pressed);
    pressed = undefined;
  });
  document.addEventListener("click", (event) => {
    const choice = event.detail === 0 && choiceAt(event.target); // by the keyboard, without a pointer
    if (choice) choose(choice);
  });
})();
