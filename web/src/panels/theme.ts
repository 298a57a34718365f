import { byId } from "./dom.ts";

const KEY = "housemartin.theme";

/** Light or dark: as the system is set, until the switch says otherwise. Calls `onChange` after each change, and once now. */
export function startTheme(onChange: (dark: boolean) => void): () => void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const read = (): string | null => {
    try {
      return localStorage.getItem(KEY);
    } catch {
      return null;  // storage is forbidden
    }
  };
  let chosen = read();
  const apply = (): void => {
    const dark = chosen ? chosen === "dark" : system.matches;
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    byId("theme").textContent = dark ? "☀" : "☾";
    onChange(dark);
  };
  const flip = (): void => {
    chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem(KEY, chosen);
    } catch { /* it holds for this visit */ }
    apply();
  };
  byId("theme").addEventListener("click", flip);
  system.addEventListener("change", apply);
  apply();
  return flip;
}

/** The value of a colour of page.css. */
export const cssColor = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
