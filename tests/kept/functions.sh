# What transcripts say often.

# edited SCRIPT FILE: bad.yaml is the file as sed's script has it.
edited() { sed "$1" "$2" >bad.yaml; }
# draw [OPTION...]: by bad.yaml.
draw() { afterglow render errand --config bad.yaml "$@" --out a.png; }
# observe [OPTION...]: the room of bad.yaml.
observe() { afterglow render errand --config projector.yaml --view observer --place near --room bad.yaml "$@" --out a.png; }
