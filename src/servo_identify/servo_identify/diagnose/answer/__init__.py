"""What a diagnosis says: report, sentence, next experiment."""
