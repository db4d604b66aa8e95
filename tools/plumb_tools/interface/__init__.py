"""The interface control document, made from the sources that it tells of."""
