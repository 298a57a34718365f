import type { Picture } from "../protocol/frames.ts";
import { byId, element } from "./dom.ts";

/** The last colour and depth picture; a press enlarges one. */
export class PictureStrip {
  private readonly shown = new Map<string, { image: HTMLImageElement; url: string }>();

  show({ which, type, file }: Picture): void {
    const url = URL.createObjectURL(new Blob([file as BlobPart], { type })), old = this.shown.get(which);
    const image = old?.image ?? this.add(which);
    if (old) URL.revokeObjectURL(old.url);
    image.src = url;
    this.shown.set(which, { image, url });
  }

  private add(which: Picture["which"]): HTMLImageElement {
    const image = element("img", { alt: `last ${which} picture` });
    const button = element("button", { type: "button", class: "picture", "aria-expanded": "false", title: `last ${which} picture`, onclick: () => {
      const large = button.getAttribute("aria-expanded") !== "true";
      button.setAttribute("aria-expanded", String(large));
    } }, image, element("span", {}, which));
    byId("pictures").append(button);
    return image;
  }
}
