"""The search: predict every press, fit effects to the residual, weigh them on places left out."""
