"""What is written of a diagnosis: the JSON, machine and probe files, tables of rows, sentences, remedies."""
