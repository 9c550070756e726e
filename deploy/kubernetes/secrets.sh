#!/bin/sh
# Puts the certificates of `riposte certs DIR` into the cluster: one Secret for each role, with its own
# key only. Run it again after `riposte certs DIR --renew ROLE`, then restart that role's pods.
#   deploy/kubernetes/secrets.sh DIR [NAMESPACE]
set -eu
if [ $# -lt 1 ] || [ $# -gt 2 ]; then
  echo "usage: secrets.sh DIR [NAMESPACE]" >&2
  exit 2
fi
folder=$1
namespace=${2:-riposte}
for role in router league learner actor metrics; do
  kubectl --namespace "$namespace" create secret generic "riposte-certificates-$role" \
    --from-file="$folder/ca.crt" \
    --from-file="$folder/$role.crt" \
    --from-file="$folder/$role.key" \
    --dry-run=client --output yaml |
    kubectl --namespace "$namespace" apply -f -
done
