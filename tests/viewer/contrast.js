// The contrast of every text on a page with what is behind it, from computed styles (WCAG 2.2, 1.4.3).
() => {
  const pixel = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const parsed = (color) => {
    pixel.clearRect(0, 0, 1, 1);
    pixel.fillStyle = color;
    pixel.fillRect(0, 0, 1, 1);
    const [red, green, blue, alpha] = pixel.getImageData(0, 0, 1, 1).data;
    return { rgb: [red, green, blue], alpha: alpha / 255 };
  };
  const mix = (share, above, below) => above.map((value, i) => share * value + (1 - share) * below[i]);
  const over = ({ rgb, alpha }, below) => mix(alpha, rgb, below);
  const luminance = (rgb) => {
    const linear = rgb.map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const ratio = (a, b) => {
    const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (high + 0.05) / (low + 0.05);
  };
  const measured = (element, color) => {
    const chain = [];
    for (let each = element; each; each = each.parentElement) chain.unshift(getComputedStyle(each));
    const seen = (k, below) => {
      const behind = over(parsed(chain[k].backgroundColor), below);
      const [ground, text] = k + 1 < chain.length ? seen(k + 1, behind) : [behind, over(parsed(color), behind)];
      const share = Number(chain[k].opacity);
      return [mix(share, ground, below), mix(share, text, below)];
    };
    if (chain.reduce((all, style) => all * Number(style.opacity), 1) < 0.01) return { ratio: Infinity }; // not shown
    const [ground, text] = seen(0, [255, 255, 255]);
    return { ratio: ratio(ground, text), text, ground };
  };
  const found = [];
  const add = (element, words, color) => {
    const box = element.getBoundingClientRect();
    if (!words.trim() || !box.width || !box.height || !element.checkVisibility({ visibilityProperty: true })) return;
    found.push({ words: words.trim().slice(0, 60), kind: element.className.baseVal ?? element.className, ...measured(element, color) });
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const element = node.parentElement;
    if (element.closest("script, style, noscript")) continue;
    const style = getComputedStyle(element);
    add(element, node.data, element instanceof SVGElement ? style.fill : style.color);
  }
  for (const field of document.querySelectorAll("input, textarea")) {
    if (!["checkbox", "hidden", "range"].includes(field.type)) add(field, field.value, getComputedStyle(field).color);
    if (!field.value) add(field, field.placeholder, getComputedStyle(field, "::placeholder").color);
  }
  return found;
}
