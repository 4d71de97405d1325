// What is on a page for keys and screen readers: rules of our own after WCAG 2.2 (1.1.1, 1.3.1, 2.1.1, 2.4.3, 2.4.7, 4.1.2).
(() => {
  const told = (element) => element.outerHTML.slice(0, 160);
  const shown = (element) => {
    const box = element.getBoundingClientRect();
    return box.width > 0 && box.height > 0 && element.checkVisibility({ visibilityProperty: true }) && !element.closest("[inert]");
  };
  const ACTIVE = "a[href], button, input:not([type=hidden]), select, textarea, summary, [tabindex], [role=button], [role=tab], [role=slider]";
  const reachable = () => [...document.querySelectorAll(ACTIVE)].filter((each) => shown(each) && !each.disabled && each.tabIndex >= 0);
  const words = (ids) => ids.split(/\s+/).map((id) => document.getElementById(id)?.textContent ?? "").join(" ");
  const name = (element) => [
    words(element.getAttribute("aria-labelledby") ?? ""), element.getAttribute("aria-label"),
    [...(element.labels ?? [])].map((label) => label.textContent).join(" "),
    element.matches("input, textarea, select, canvas, [role=slider]") ? "" : element.textContent, element.title, element.placeholder,
  ].find((text) => text?.trim()) ?? "";

  window.reach = {
    unnamed: () => reachable().filter((each) => !name(each)).map(told),
    // clicked by a mouse and by nothing else
    unreached: () => [...document.querySelectorAll("[role=button], [role=tab], button, [style*='cursor: pointer']")]
      .filter((each) => shown(each) && !each.disabled && each.tabIndex < 0 && !each.querySelector("button, [tabindex]")
        && !each.closest("[tabindex='0'], [aria-hidden=true], [data-send]") && !each.matches(".mantine-NumberInput-control")
        && !each.closest("[role=tablist]")?.querySelector("[role=tab][tabindex='0']")) // there arrow keys lead on
      .map(told),
    nested: () => reachable().filter((each) => each.matches("button, [role=button], [role=tab], a[href]")
      && each.querySelector("button, [role=button], input, select, textarea, a[href]")).map(told),
    pictures: () => [...document.querySelectorAll("svg, img, canvas")].filter((each) => shown(each)
      && !each.closest("[aria-hidden=true]") && !each.getAttribute("aria-label") && !each.hasAttribute("alt")
      && !(each.closest("[aria-label]") ?? each).matches("[role=img], button, [role=button]")
      && ![each.closest("button, [role=button]")].some((button) => button && each.matches("svg") && name(button))) // an icon
      .map(told),
    dangling: () => [...document.querySelectorAll("[aria-labelledby], [aria-describedby]")].filter(shown).filter((each) =>
      ["aria-labelledby", "aria-describedby"].some((key) => (each.getAttribute(key) ?? "").split(/\s+/).filter(Boolean)
        .some((id) => !document.getElementById(id)))).map(told),
    // regions that scroll, but not by keys
    scrolling: () => [...document.querySelectorAll("body *")].filter((each) => shown(each) && each.tabIndex < 0
      && /auto|scroll/.test(getComputedStyle(each).overflowY) && each.scrollHeight > each.clientHeight + 1
      && !reachable().some((one) => each.contains(one))).map(told),
    twice: () => [...document.querySelectorAll("[id]")].map((each) => each.id)
      .filter((id, k, all) => all.indexOf(id) < k),
    page: () => Object.entries({ lang: document.documentElement.lang, title: document.title.trim(),
      zoom: !/user-scalable=no|maximum-scale/.test(document.querySelector("meta[name=viewport]")?.content) })
      .flatMap(([what, found]) => (found ? [] : [what])),
    // Tab from the start of the page: number the elements, and see that each shows that it has the focus
    begin: () => {
      const start = document.createElement("i"); // Tab goes on from the last focus: put it before everything
      start.tabIndex = -1;
      document.body.prepend(start);
      start.focus();
      window.reach.all = reachable();
      window.reach.met = new Set();
      return window.reach.all.length;
    },
    step: () => {
      const now = document.activeElement;
      if (now === document.body || window.reach.met.has(now)) return null;
      window.reach.met.add(now);
      const style = getComputedStyle(now);
      const seen = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2;
      return { told: told(now), seen, color: style.outlineColor };
    },
    left: () => window.reach.all.filter((each) => !window.reach.met.has(each) && each.isConnected && shown(each)).map(told),
  };
})();
