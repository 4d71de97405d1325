// Logarithmic sliders of factors, with a field of the value. The value is a hidden number of the page.
(() => {
  const values = new Map(); // by label
  const boxOf = (element) => element?.closest?.("[data-factor]");
  const parts = (box) => {
    const [range, field] = box.querySelectorAll("input");
    return { range, field, label: box.dataset.factor, low: +box.dataset.low, least: +field.min, most: +field.max };
  };
  const placeOf = ({ low, most }, value) => (value <= low ? 0 : Math.log(value / low) / Math.log(most / low));
  const valueAt = ({ low, least, most }, place) =>
    place <= 0 ? least : Number((low * (most / low) ** place).toPrecision(3));

  const show = () => {
    for (const box of document.querySelectorAll("[data-factor]")) {
      const { range, field, label, ...ends } = parts(box);
      if (!values.has(label)) {
        values.set(label, 1);
        window.sagline.on(`number ${label}`, (value) => {
          values.set(label, value);
          show();
        });
      }
      const value = values.get(label);
      const text = String(Number(value.toPrecision(6)));
      range.value = placeOf(ends, value);
      if (range.getAttribute("aria-valuetext") !== text) range.setAttribute("aria-valuetext", text);
      if (field !== document.activeElement || field.dataset.edited === undefined) field.value = text;
    }
  };
  const type = ({ field, label, least, most }) => {
    delete field.dataset.edited;
    const value = field.valueAsNumber;
    if (Number.isFinite(value)) window.sagline.set(label, Math.min(Math.max(value, least), most));
    show();
  };

  document.addEventListener("input", ({ target }) => {
    const box = boxOf(target);
    if (!box) return;
    const all = parts(box);
    if (target === all.range) window.sagline.set(all.label, valueAt(all, target.valueAsNumber));
    else target.dataset.edited = "";
  });
  document.addEventListener("change", ({ target }) => {
    const box = boxOf(target);
    if (box && target.type === "number") type(parts(box));
  });
  document.addEventListener("dblclick", ({ target }) => {
    const box = boxOf(target);
    if (box && target.type === "range") window.sagline.set(box.dataset.factor, 1);
  });
  window.sagline.dress(show);
})();
