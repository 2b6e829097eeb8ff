#!/usr/bin/env bash
# usage: docs/gallery.sh QUAVD DIRECTORY
# Plans every example and makes a page of them: DIRECTORY/index.html with a picture of each, its
# report and the planned mission beside it. `make gallery` runs this.
set -euo pipefail
quavd=$(realpath "$1"); out=$2
cd "$(dirname "$0")/.."
mkdir -p "$out"
index=$out/index.html
cat >"$index" <<'PAGE'
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>quavd: gallery</title>
<link rel="icon" href="data:,">
<style>
body{font:16px/1.5 system-ui,sans-serif;max-width:80rem;margin:0 auto;padding:0 1rem}
ul{list-style:none;padding:0;display:grid;gap:1.2rem;grid-template-columns:repeat(auto-fill,minmax(min(100%,22rem),1fr))}
img{width:100%;height:auto;border:1px solid #8884;border-radius:.5rem;background:#fff}
h2{font-size:1rem;margin:.4rem 0 0}p{margin:0}
</style>
</head>
<body>
<h1>Missions planned by quavd</h1>
<ul>
PAGE
for plan in fence_examples/*.plan; do
	name=$(basename "$plan" .plan)
	code=0
	said=$("$quavd" --quiet plan "$plan" --out "$out/$name.svg" --out "$out/$name.html" --out "$out/$name.plan" 2>&1) || code=$?
	[ $code = 0 ] || [ $code = 3 ] || { echo "$plan: $said" >&2; exit $code; }
	first=$(printf '%s' "$said" | awk '!NF {exit} 1' | sed 's/&/\&amp;/g; s/</\&lt;/g')
	files="<a href=\"$name.html\">report</a>"
	[ $code = 3 ] || files="$files, <a href=\"$name.plan\">planned mission</a>"
	cat >>"$index" <<ENTRY
<li><a href="$name.html"><img src="$name.svg" alt="Map of $name" loading="lazy"></a>
<h2>$name</h2><p>$first</p><p>$files</p></li>
ENTRY
done
printf '</ul>\n</body>\n</html>\n' >>"$index"
echo "$index: $(grep -c '<li>' "$index") examples"
